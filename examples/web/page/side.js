// One side of the page: a demo, its drawing and its figures.
import { Demo } from "./demo.js";
import { View } from "./view.js";

const timesKept = 60;

export class Side {
  // element: the section of index.html; exports: of an instance of the module that no other side has
  constructor(element, exports, withLazyccd, renderer, shared) {
    this.element = element;
    this.exports = exports;
    this.withLazyccd = withLazyccd;
    this.view = new View(element.querySelector("canvas"), renderer, shared);
  }

  // scene: index in scenes.js; faces: "smooth" or "flat"; speed: m/s; size: factor of the number of nodes
  restart(scene, faces, speed, size) {
    if (this.demo) this.demo.delete();
    this.demo = new Demo(this.exports, scene, this.withLazyccd, speed, size);
    this.view.show(this.demo, faces);
    this.times = [];  // ms, of the last steps
    this.passed = 0;
    this.exploded = false;
    this.writeFigures();
  }

  // Returns the time of the step in ms, without the counting. A side that exploded stands still.
  step() {
    if (this.exploded) return NaN;
    const start = performance.now();
    this.demo.step();
    const time = performance.now() - start;
    this.times.push(time);
    if (this.times.length > timesKept) this.times.shift();
    this.exploded = !this.demo.isFinite();
    if (!this.exploded) this.passed = this.demo.count();
    return time;
  }

  draw() {
    if (!this.exploded) this.view.update();
    this.view.draw();
  }

  writeFigures() {
    const write = (name, text) => {
      const place = this.element.querySelector(name);
      if (place.textContent !== text) place.textContent = text;
    };
    write(".passed", this.passed.toLocaleString("en"));
    write(".time", this.times.length ? `${median(this.times).toFixed(1)} ms` : "–");
    write(".margin", (1000 * this.demo.margin()).toFixed(0));
    write(".state", this.exploded ? "exploded" : "");
    this.element.querySelector(".passed").classList.toggle("some", this.passed > 0);
  }
}

// Leaves out what is not a number.
export function median(values) {
  const sorted = values.filter((value) => !Number.isNaN(value)).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor(sorted.length / 2)] : NaN;
}
