// Worlds of Bullet with LazyCCD, in JavaScript. What each function does is in lazyccd.d.ts.
import * as check from "./arguments.js";
import { instantiate, isSupported } from "./instantiate.js";
import { Memory } from "./memory.js";

export { isSupported };

export default async function load(source = new URL("./lazyccd.wasm", import.meta.url), print = console.warn) {
  const module = await instantiate(source, print);
  return {
    createWorld: (options = {}) => new World(new Memory(module), options),
    get memoryBytes() {
      return module.memory.buffer.byteLength;
    },
  };
}

// Constructors are called with what the module has: the classes are not exported.

class World {
  #memory;
  #module;
  #address;
  #bodies = new Set();
  #contactWords;

  constructor(memory, options) {
    check.object(options, "options", ["kind", "collisions", "gravity", "solver"]);
    const kind = check.choice(options.kind ?? "rigid", "options.kind", ["rigid", "deformable"]);
    const collisions = check.choice(options.collisions ?? "lazyccd", "options.collisions", ["lazyccd", "bullet"]);
    const gravity = check.vector(options.gravity ?? [0, -9.81, 0], "options.gravity");
    this.#memory = memory;
    this.#module = memory.module;
    this.#module.clear_options();
    for (const [name, value] of Object.entries(options.solver ?? {})) {
      if (typeof value !== "number" && typeof value !== "boolean")
        throw new TypeError(`options.solver.${name} is neither a number nor true or false`);
      const isSet = memory.withText(name, (key) =>
        memory.withText(String(Number(value)), (text) => this.#module.set_option(key, text)));
      if (!isSet) throw new RangeError(`options.solver: ${this.#error()}`);
    }
    this.#address = this.#module.world_new(kind, collisions, ...gravity);
    if (!this.#address) throw new Error(this.#error());
    this.isDeformable = kind === 1;
    this.#contactWords = this.#module.reserve(8 * 4);
  }

  #error() {
    return this.#memory.text(this.#module.last_error());
  }

  // For bodies: the module's function `name` for this world.
  call(name, ...rest) {
    if (!this.#address) throw new Error("the world is disposed");
    return this.#module[name](this.#address, ...rest);
  }

  get memory() {
    return this.#memory;
  }

  addSoftBody(options) {
    const body = new SoftBody(this, options, () => this.#error());
    this.#bodies.add(body);
    return body;
  }

  addRigidBody(options) {
    const body = new RigidBody(this, options, () => this.#error());
    this.#bodies.add(body);
    return body;
  }

  forget(body) {
    this.#bodies.delete(body);
  }

  step(seconds) {
    check.positive(seconds, "seconds");
    if (!this.call("world_step", seconds)) throw new Error(this.#error());
  }

  get contacts() {
    this.call("world_contacts", this.#contactWords);
    const [count, bodies, nodes, kinds, points, normals, impulses, times] =
      new Uint32Array(this.#module.memory.buffer, this.#contactWords, 8);
    const memory = this.#memory;
    return {
      count,
      bodies: memory.integers(bodies, 2 * count),
      nodes: memory.integers(nodes, 4 * count),
      kinds: memory.integers(kinds, count),
      points: memory.floats(points, 3 * count),
      normals: memory.floats(normals, 3 * count),
      impulses: memory.floats(impulses, count),
      times: memory.floats(times, count),
    };
  }

  get stats() {
    const lines = this.#memory.text(this.call("world_stats")).split("\n").filter(Boolean);
    return Object.fromEntries(lines.map((line) => line.split(" ")).map(([name, value]) => [name, Number(value)]));
  }

  get status() {
    return this.#memory.text(this.call("world_status"));
  }

  dispose() {
    if (!this.#address) return;
    for (const body of this.#bodies) body.id = -1;
    this.#bodies.clear();
    this.#module.release(this.#contactWords);
    this.#module.world_delete(this.#address);
    this.#address = 0;
  }
}

class Body {
  world;
  id = -1;

  constructor(world) {
    Object.defineProperty(this, "world", { value: world, enumerable: false });
  }

  call(name, ...rest) {
    if (this.id < 0) throw new Error("the body is removed");
    return this.world.call(name, this.id, ...rest);
  }

  remove() {
    this.call("body_remove");
    this.world.forget(this);
    this.id = -1;
  }
}

// Numbers of a soft body in the order of SoftBodyNumber (native/world.h): default, check.
const fraction = (value, name) => check.number(value, name, 0, 1);
const notNegative = (value, name) => check.number(value, name, 0);
const softNumbers = {
  mass: [1, check.positive],
  margin: [0.01, notNegative],
  stiffness: [1, fraction],
  friction: [0.2, notNegative],
  damping: [0, fraction],
  pressure: [0, check.number],
  iterations: [10, (value, name) => check.whole(value, name, 0, 1000)],
  selfCollision: [false, check.truth],
};
const softNames = Object.keys(softNumbers);

class SoftBody extends Body {
  #numbers = {};

  constructor(world, options, error) {
    super(world);
    check.object(options, "options", ["positions", "faces", "links", "tetrahedra", "pinned", "bending", "springs",
      "elasticity", ...softNames]);
    const positions = check.floats(options.positions, "positions", 3);
    this.nodeCount = positions.length / 3;
    const list = (name, group) => check.indices(options[name] ?? [], name, group, this.nodeCount);
    const lists = [list("faces", 3), list("links", 2), list("tetrahedra", 4), list("pinned", 1)];
    const bending = options.bending === undefined ? 0 : check.whole(options.bending, "bending", 2, 100);
    for (const name of softNames)
      this.#numbers[name] = softNumbers[name][1](options[name] ?? softNumbers[name][0], name);
    const springs = this.#force(options, "springs", ["stiffness"]);
    const elasticity = this.#force(options, "elasticity", ["mu", "lambda"]);

    const [faces, links, tetrahedra, pinned] = lists;
    this.id = world.memory.withAll([positions, ...lists], (x, f, l, t, p) =>
      world.call("soft_add", x, this.nodeCount, f, faces.length / 3, l, links.length / 2, t,
        tetrahedra.length / 4, p, pinned.length));
    if (this.id < 0) throw new Error(error());
    for (const name of softNames) this.#set(name, this.#numbers[name]);
    if (bending) this.call("soft_bending", bending);
    if (springs) this.call("soft_springs", ...springs);
    if (elasticity) this.call("soft_elasticity", ...elasticity);
  }

  // The numbers of a force of the deformable world, then its damping. Nothing if it is not wanted.
  #force(options, name, numbers) {
    if (options[name] === undefined) return undefined;
    if (!this.world.isDeformable) throw new TypeError(`${name}: the rigid world has none`);
    const force = check.object(options[name], name, [...numbers, "damping"]);
    return [...numbers.map((key) => notNegative(force[key], `${name}.${key}`)),
      notNegative(force.damping ?? 0, `${name}.damping`)];
  }

  #set(name, value) {
    this.call("soft_set", softNames.indexOf(name), Number(value));
    this.#numbers[name] = value;
  }

  #node(node) {
    return check.whole(node, "node", 0, this.nodeCount - 1);
  }

  get positions() {
    return this.world.memory.floats(this.call("soft_positions"), 3 * this.nodeCount);
  }

  get velocities() {
    return this.world.memory.floats(this.call("soft_velocities"), 3 * this.nodeCount);
  }

  place(positions, velocities) {
    const all = (value, name) => {
      const array = check.floats(value, name, 3);
      if (array.length !== 3 * this.nodeCount)
        throw new RangeError(`${name} has ${array.length} numbers; the body has ${this.nodeCount} nodes`);
      return array;
    };
    const arrays = [all(positions, "positions"),
      velocities === undefined ? new Float32Array() : all(velocities, "velocities")];
    this.world.memory.withAll(arrays, (x, v) => this.call("soft_place", x, v));
  }

  pin(node) {
    this.call("soft_pin", this.#node(node), 1);
  }

  unpin(node) {
    this.call("soft_pin", this.#node(node), 0);
  }

  moveNode(node, position) {
    this.call("soft_steer", this.#node(node), ...check.vector(position, "position"));
  }

  addForce(force, node) {
    this.call("soft_push", node === undefined ? -1 : this.#node(node), ...check.vector(force, "force"));
  }

  static {
    for (const name of softNames) {
      Object.defineProperty(SoftBody.prototype, name, {
        get() {
          return this.#numbers[name];
        },
        set(value) {
          this.#set(name, softNumbers[name][1](value, name));
        },
      });
    }
  }
}

// Shapes in the order of `Shape` in native/exports.cpp: their members, and the numbers that they are.
const shapes = {
  box: [["halfExtents"], (s) => Array.from(check.vector(s.halfExtents, "shape.halfExtents"),
    (x, i) => check.positive(x, `shape.halfExtents[${i}]`))],
  sphere: [["radius"], (s) => [check.positive(s.radius, "shape.radius")]],
  capsule: [["radius", "height"],
    (s) => [check.positive(s.radius, "shape.radius"), notNegative(s.height, "shape.height")]],
  plane: [["normal", "offset"],
    (s) => [...check.direction(s.normal, "shape.normal"), check.number(s.offset ?? 0, "shape.offset")]],
  convex: [["positions"], (s) => check.floats(s.positions, "shape.positions", 3, 4)],
  mesh: [["positions", "faces"], (s) => check.floats(s.positions, "shape.positions", 3, 3)],
};

class RigidBody extends Body {
  #isKinematic;

  constructor(world, options, error) {
    super(world);
    check.object(options, "options", ["shape", "position", "rotation", "mass", "kinematic", "friction", "margin"]);
    const types = Object.keys(shapes);
    const type = check.choice(options.shape?.type, "shape.type", types);
    const [members, numbersOf] = shapes[types[type]];
    const shape = check.object(options.shape, "shape", ["type", ...members]);
    const numbers = Float32Array.from(numbersOf(shape));
    const isMesh = types[type] === "mesh";
    const faces = isMesh ? check.indices(shape.faces, "shape.faces", 3, numbers.length / 3, 1) : new Int32Array();
    const mass = notNegative(options.mass ?? 0, "mass");
    this.#isKinematic = check.truth(options.kinematic ?? false, "kinematic");
    if (mass > 0 && (isMesh || types[type] === "plane" || this.#isKinematic))
      throw new RangeError(`mass is ${mass}; meshes, planes and kinematic bodies have none`);
    const pose = poseOf(options.position ?? [0, 0, 0], options.rotation ?? [0, 0, 0, 1]);
    const friction = notNegative(options.friction ?? 0.5, "friction");
    const margin = options.margin === undefined ? -1 : notNegative(options.margin, "margin");
    this.id = world.memory.withAll([numbers, faces, pose], (n, f, p) =>
      world.call("rigid_add", type, n, numbers.length, f, faces.length / 3, mass, Number(this.#isKinematic), p,
        friction, margin));
    if (this.id < 0) throw new Error(error());
  }

  get position() {
    return this.world.memory.floats(this.call("rigid_pose"), 7).subarray(0, 3);
  }

  get rotation() {
    return this.world.memory.floats(this.call("rigid_pose"), 7).subarray(3);
  }

  moveTo(position, rotation = Array.from(this.rotation)) {
    if (!this.#isKinematic) throw new TypeError("moveTo: the body is not kinematic");
    this.world.memory.with(poseOf(position, rotation), (pose) => this.call("rigid_move", pose));
  }

  teleport(position, rotation = Array.from(this.rotation)) {
    this.world.memory.with(poseOf(position, rotation), (pose) => this.call("rigid_teleport", pose));
  }
}

function poseOf(position, rotation) {
  return Float32Array.from([...check.vector(position, "position"), ...check.rotation(rotation, "rotation")]);
}
