// The camera that both sides share. It turns about a point.
import { PerspectiveCamera, Vector3 } from "./three.module.js";

const radian = Math.PI / 180;
const viewAngle = 36;  // degrees, of the shorter side of a drawing
const nearest = 0.5, farthest = 12;  // m

export class SharedCamera {
  constructor() {
    this.camera = new PerspectiveCamera(viewAngle, 1, 0.05, 50);
    this.target = new Vector3();
  }

  // `view` is one of scenes.js.
  place(view) {
    this.target.fromArray(view.target);
    this.distance = view.distance;
    this.turnAngle = view.turn;
    this.heightAngle = view.height;
    this.update();
  }

  // Angles in degrees.
  turn(aside, up) {
    this.turnAngle += aside;
    this.heightAngle = clamp(this.heightAngle + up, -85, 85);
    this.update();
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, nearest, farthest);
    this.update();
  }

  // aspect: width by height of a drawing
  setAspect(aspect) {
    const half = Math.tan(viewAngle / 2 * radian);
    this.camera.aspect = aspect;
    this.camera.fov = 2 * Math.atan(half / Math.min(aspect, 1)) / radian;
    this.camera.updateProjectionMatrix();
  }

  update() {
    const turn = this.turnAngle * radian, height = this.heightAngle * radian;
    const direction = new Vector3(Math.sin(turn) * Math.cos(height), Math.sin(height),
      Math.cos(turn) * Math.cos(height));
    this.camera.position.copy(this.target).addScaledVector(direction, this.distance);
    this.camera.lookAt(this.target);
    this.camera.updateMatrixWorld();
  }
}

function clamp(value, least, most) { return Math.min(Math.max(value, least), most); }
