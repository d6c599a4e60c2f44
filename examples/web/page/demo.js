// A scene in the module: Bullet alone or with LazyCCD. See native/exports.cpp.
export class Demo {
  // speed: m/s; size: factor of the number of nodes along each side of a body
  constructor(exports, scene, withLazyccd, speed, size) {
    this.exports = exports;
    this.address = exports.demo_new(scene, withLazyccd ? 1 : 0, speed, size);
  }

  delete() { this.exports.demo_delete(this.address); }

  step() { this.exports.demo_step(this.address); }

  // Must be called after each step. Returns the pass-throughs of all steps.
  count() { return this.exports.demo_count(this.address); }

  isFinite() { return this.exports.demo_is_finite(this.address) !== 0; }

  // In metres, of each body.
  margin() { return this.exports.demo_margin(this.address); }

  // Of the positions of all nodes, to compare runs to the bit.
  hash() { return this.exports.demo_hash(this.address) >>> 0; }

  // Puts the bodies where they are now into what positions() returns.
  updatePositions() { this.exports.demo_draw(this.address); }

  bodyCount() { return this.exports.demo_bodies(this.address); }

  isSoft(body) { return this.exports.demo_is_soft(this.address, body) !== 0; }

  // x, y, z of each vertex, in metres. Valid until the next call of the module.
  positions(body) {
    const vertices = this.exports.demo_vertex_count(this.address, body);
    return this.floats(this.exports.demo_positions(this.address, body), 3 * vertices);
  }

  // Three vertices of each face. Valid until the next call of the module.
  faces(body) {
    const faces = this.exports.demo_face_count(this.address, body);
    const address = this.exports.demo_faces(this.address, body);
    return new Uint32Array(this.exports.memory.buffer, address, 3 * faces);
  }

  // Both ends of a line at each contact, x, y, z. Valid until the next call of the module.
  contactPoints() {
    const contacts = this.exports.demo_contacts(this.address);
    return this.floats(this.exports.demo_contact_points(this.address), 6 * contacts);
  }

  // Pulls a node of a soft body towards the point of drag(), until letGo().
  grab(body, node) { this.exports.demo_grab(this.address, body, node); }

  drag(point) { this.exports.demo_drag(this.address, point.x, point.y, point.z); }

  letGo() { this.exports.demo_let_go(this.address); }

  floats(address, count) { return new Float32Array(this.exports.memory.buffer, address, count); }
}

// In m/s.
export function defaultSpeed(exports, scene) { return exports.demo_speed(scene); }
