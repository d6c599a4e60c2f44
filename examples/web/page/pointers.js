// Mouse and touch on the drawings: one pointer pulls a body or turns the view, two zoom.
import { Vector2 } from "./three.module.js";

const degreesPerPixel = 0.35;
const zoomPerTurn = 1.1;  // of the wheel

// Calls redraw() after each change.
export function listenToPointers(comparison, shared, redraw) {
  for (const side of comparison.sides) listen(side, comparison, shared, redraw);
}

function listen(side, comparison, shared, redraw) {
  const { view } = side;
  const { canvas } = view;
  const pointers = new Map();  // place of each that is down, pixels
  let pulled = null;  // where the pulled node was, m

  const pick = (event) => (side.exploded ? null : view.pick(placeOn(canvas, event)));
  const drag = (event) => comparison.drag(view.pointAt(placeOn(canvas, event), pulled));

  function letGo() {
    pulled = null;
    comparison.letGo();
  }

  function down(event) {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const found = pointers.size === 1 && pick(event);
    if (found) {
      pulled = view.positionOf(found.body, found.node);
      comparison.grab(found.body, found.node);
      drag(event);
    } else {
      letGo();
    }
    canvas.style.cursor = "grabbing";
    redraw();
  }

  function move(event) {
    const before = pointers.get(event.pointerId);
    if (!before) {
      canvas.style.cursor = pick(event) ? "grab" : "move";
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    if (pointers.size > 1) {
      const gap = gapOf(pointers);
      pointers.set(event.pointerId, now);
      shared.zoom(gap / Math.max(gapOf(pointers), 1));
    } else if (pulled) {
      drag(event);
    } else {
      shared.turn((before.x - now.x) * degreesPerPixel, (now.y - before.y) * degreesPerPixel);
    }
    pointers.set(event.pointerId, now);
    redraw();
  }

  function up(event) {
    pointers.delete(event.pointerId);
    letGo();
    canvas.style.cursor = "";
    redraw();
  }

  function wheel(event) {
    event.preventDefault();
    shared.zoom(zoomPerTurn ** Math.sign(event.deltaY));
    redraw();
  }

  canvas.addEventListener("pointerdown", down);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("wheel", wheel, { passive: false });
}

// Pixels between the first two.
function gapOf(pointers) {
  const [a, b] = pointers.values();
  return Math.hypot(a.x - b.x, a.y - b.y);
}

// -1 to 1 from left to right and from bottom to top.
function placeOn(canvas, event) {
  const box = canvas.getBoundingClientRect();
  const x = (event.clientX - box.left) / box.width, y = (event.clientY - box.top) / box.height;
  return new Vector2(2 * x - 1, 1 - 2 * y);
}
