// Both sides, stepped together with the same inputs.
import { scenes } from "./scenes.js";
import { median } from "./side.js";

const stepsPerChunk = 10;  // of run(), between which the browser may do other work

export class Comparison {
  constructor(left, right) {
    this.left = left;
    this.right = right;
    this.sides = [left, right];
  }

  // scene: index in scenes.js; speed: m/s; size: factor of the number of nodes
  restart(scene, speed, size) {
    for (const side of this.sides) side.restart(scene, scenes[scene].faces, speed, size);
    this.steps = 0;
  }

  // Returns the times of both sides, ms.
  step() {
    ++this.steps;
    return this.sides.map((side) => side.step());
  }

  // Returns the figures of both sides after that many steps; ms: median of these steps.
  async run(steps) {
    const times = [];
    for (let done = 0; done < steps; ++done) {
      if (done % stepsPerChunk === 0) await new Promise((resume) => setTimeout(resume));
      times.push(this.step());
    }
    const figures = (side, index) => (
      { passed: side.passed, ms: median(times.map((pair) => pair[index])), hash: side.demo.hash() });
    return { left: figures(this.left, 0), right: figures(this.right, 1) };
  }

  // Pulls a node of a soft body towards the point of drag(), until letGo().
  grab(body, node) {
    for (const side of this.sides) side.demo.grab(body, node);
  }

  drag(point) {
    for (const side of this.sides) {
      side.demo.drag(point);
      side.view.mark(point);
    }
  }

  letGo() {
    for (const side of this.sides) {
      side.demo.letGo();
      side.view.mark(null);
    }
  }

  draw() {
    for (const side of this.sides) side.draw();
  }

  writeFigures() {
    for (const side of this.sides) side.writeFigures();
  }

  // Takes the colours of the style sheet again.
  readColours() {
    for (const side of this.sides) side.view.readColours();
  }
}
