// The form above the drawings, and the keys.
import { scenes } from "./scenes.js";

const form = document.getElementById("controls");
const { speed, size, pause, step, restart, contacts } = form.elements;

// Calls what `actions` has: select(scene), restart(), pause(), step(), showContacts(shown), and for the
// camera turn(aside, up) and zoom(factor).
export function listenToControls(actions) {
  const fieldset = document.getElementById("scenes");
  scenes.forEach((scene, index) => fieldset.append(choice(scene.title, index, actions)));
  for (const slider of [speed, size]) {
    slider.addEventListener("input", writeSliders);
    slider.addEventListener("change", () => actions.restart());
  }
  pause.addEventListener("click", () => actions.pause());
  step.addEventListener("click", () => actions.step());
  restart.addEventListener("click", () => actions.restart());
  contacts.addEventListener("change", () => actions.showContacts(contacts.checked));
  form.addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("keydown", (event) => onKey(event, actions));
}

// Shows which scene was chosen. defaultSpeed: m/s
export function showScene(index, defaultSpeed) {
  form.elements.scene[index].checked = true;
  document.getElementById("description").textContent = scenes[index].description;
  speed.max = scenes[index].fastest;
  speed.step = scenes[index].fastest > 10 ? 0.5 : 0.1;
  speed.value = defaultSpeed;
  writeSliders();
}

export function showPaused(paused) { pause.textContent = paused ? "Run" : "Pause"; }

// Speed in m/s; size, factor of the number of nodes.
export function chosen() { return { speed: speed.valueAsNumber, size: size.valueAsNumber }; }

function choice(title, index, actions) {
  const label = document.createElement("label");
  const input = document.createElement("input");
  Object.assign(input, { type: "radio", name: "scene", value: index });
  input.addEventListener("change", () => actions.select(index));
  const text = document.createElement("span");
  text.textContent = title;
  label.append(input, text);
  return label;
}

function writeSliders() {
  const write = (slider, text) => {
    slider.nextElementSibling.textContent = text;
    slider.setAttribute("aria-valuetext", text);
  };
  write(speed, `${speed.valueAsNumber.toFixed(1)} m/s`);
  write(size, `× ${size.valueAsNumber.toFixed(1)}`);
}

// Space pauses if no control has the focus. Arrows, + and - turn and zoom if a drawing has it.
function onKey(event, actions) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const onDrawing = event.target instanceof HTMLCanvasElement;
  if (!onDrawing && event.target !== document.body) return;
  const views = {
    ArrowLeft: () => actions.turn(-5, 0), ArrowRight: () => actions.turn(5, 0),
    ArrowUp: () => actions.turn(0, 5), ArrowDown: () => actions.turn(0, -5),
    "+": () => actions.zoom(0.9), "=": () => actions.zoom(0.9), "-": () => actions.zoom(1.1),
  };
  const action = event.key === " " ? () => actions.pause() : onDrawing && views[event.key];
  if (!action) return;
  event.preventDefault();
  action();
}
