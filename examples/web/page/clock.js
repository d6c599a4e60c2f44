// Tells when a step is due: 60 a second, at most one at each frame of the display.
const stepTime = 1000 / 60;  // ms
const mostDue = 1.75 * stepTime;  // what is later is dropped, so that steps do not pile up
const tolerance = 0.25 * stepTime;  // frames of a display of 60 Hz come a little early or late

export class Clock {
  constructor() {
    this.due = 0;  // ms
    this.last = 0;  // ms, time of the last frame
  }

  // now: ms, time of this frame
  isStepDue(now) {
    this.due = Math.min(this.due + now - this.last, mostDue);
    this.last = now;
    if (this.due < stepTime - tolerance) return false;
    this.due -= stepTime;
    return true;
  }
}
