// Loads the module, connects controls and sides, and draws at each frame of the display.
import { SharedCamera } from "./camera.js";
import { Clock } from "./clock.js";
import { Comparison } from "./comparison.js";
import { chosen, listenToControls, showPaused, showScene } from "./controls.js";
import { defaultSpeed } from "./demo.js";
import { instantiate } from "./instantiate.js";
import { listenToPointers } from "./pointers.js";
import { scenes } from "./scenes.js";
import { Side } from "./side.js";
import { makeRenderer } from "./view.js";

const stepsPerWriting = 6;  // figures that change at each step cannot be read

// Starts the page. Returns what tests call.
export async function startPage() {
  const module = await load("./page.wasm");
  const shared = new SharedCamera();
  const renderer = makeRenderer();
  const makeSide = async (name, withLazyccd) => (
    new Side(document.getElementById(name), await instantiate(module), withLazyccd, renderer, shared));
  const comparison = new Comparison(await makeSide("left", false), await makeSide("right", true));
  const clock = new Clock();

  let scene = 0;
  let paused = false;
  let running = false;  // run()
  let changed = true;  // since the last drawing
  const redraw = () => { changed = true; };

  function restart() {
    const { speed, size } = chosen();
    comparison.restart(scene, speed, size);
    redraw();
  }

  function select(index) {
    scene = index;
    showScene(scene, defaultSpeed(comparison.left.exports, scene));
    shared.place(scenes[scene].camera);
    restart();
  }

  function pause(value) {
    paused = value;
    showPaused(paused);
  }

  function step() {
    comparison.step();
    redraw();
  }

  // Pauses, and draws after the last step alone.
  async function run(steps) {
    pause(true);
    running = true;
    const figures = await comparison.run(steps);
    running = false;
    show();
    return figures;
  }

  function show() {
    comparison.draw();
    if (paused || comparison.steps % stepsPerWriting === 0) comparison.writeFigures();
    changed = false;
  }

  function frame(now) {
    if (clock.isStepDue(now) && !paused) step();
    if (changed && !running) show();
    requestAnimationFrame(frame);
  }

  listenToControls({
    select,
    restart,
    pause() { pause(!paused); },
    step() { pause(true); step(); },
    showContacts(shown) { comparison.right.view.showContacts(shown); redraw(); },
    turn(aside, up) { shared.turn(aside, up); redraw(); },
    zoom(factor) { shared.zoom(factor); redraw(); },
  });
  listenToPointers(comparison, shared, redraw);
  window.addEventListener("resize", redraw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    comparison.readColours();
    redraw();
  });

  select(0);
  pause(window.matchMedia("(prefers-reduced-motion: reduce)").matches);
  requestAnimationFrame(frame);
  return {
    select(index) { pause(true); select(index); },
    run,
    state: () => ({
      scene,
      paused,
      steps: comparison.steps,
      camera: { turn: shared.turnAngle, height: shared.heightAngle, distance: shared.distance },
    }),
  };
}

async function load(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address}: ${response.status} ${response.statusText}`);
  return WebAssembly.compile(await response.arrayBuffer());
}
