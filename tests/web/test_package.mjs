// Tests of the JavaScript package under node:
//
//   PACKAGE=build/wasm/plugin/javascript/package node --test tests/web/test_package.mjs
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import path from "node:path";
import { pathToFileURL } from "node:url";
import test from "node:test";

const folder = path.resolve(process.env.PACKAGE ?? "build/wasm/plugin/javascript/package");
const { default: load, isSupported } = await import(pathToFileURL(path.join(folder, "lazyccd.js")));
const lazyccd = await load();

// A level square cloth, 1 m wide, of n x n nodes.
function cloth(n, height = 0) {
  const positions = [], faces = [];
  for (let row = 0; row < n; ++row)
    for (let column = 0; column < n; ++column)
      positions.push(column / (n - 1) - 0.5, height, row / (n - 1) - 0.5);
  for (let row = 0; row + 1 < n; ++row) {
    for (let column = 0; column + 1 < n; ++column) {
      const a = row * n + column;
      faces.push(a, a + n, a + 1, a + 1, a + n, a + n + 1);
    }
  }
  return { positions, faces };
}

const heights = (body) => body.positions.filter((_, i) => i % 3 === 1);

test("the package is complete", async () => {
  assert.ok(isSupported());
  const { files, exports } = JSON.parse(await readFile(path.join(folder, "package.json"), "utf8"));
  for (const file of [...files.filter((name) => !name.includes("*")), exports["."].default, exports["."].types])
    assert.ok((await readFile(path.join(folder, file))).length > 0, file);
});

for (const kind of ["rigid", "deformable"]) {
  test(`a cloth falls on a box and rests on it: ${kind}`, () => {
    const world = lazyccd.createWorld({ kind });
    const box = world.addRigidBody({ shape: { type: "box", halfExtents: [2, 0.5, 2] }, position: [0, -0.5, 0] });
    const body = world.addSoftBody({ ...cloth(11, 0.2), margin: 0.02,
      ...(kind === "deformable" ? { springs: { stiffness: 100, damping: 1 } } : {}) });
    const seconds = kind === "rigid" ? 1 / 60 : 1 / 240;
    for (let i = 0; i < 1.5 / seconds; ++i) world.step(seconds);
    for (const y of heights(body)) assert.ok(y > 0 && y < 0.1, `a node is at ${y}`);
    const { count, bodies, nodes, kinds, points, normals, impulses, times } = world.contacts;
    assert.ok(count > 0);
    assert.deepEqual([bodies.length, nodes.length, kinds.length, points.length, normals.length, impulses.length,
      times.length], [2 * count, 4 * count, count, 3 * count, 3 * count, count, count]);
    assert.deepEqual(new Set(bodies), new Set([body.id, box.id]));
    // The contacts carry the cloth: their impulses are its weight, on average.
    const lift = impulses.reduce((sum, impulse, i) => sum + impulse * Math.abs(normals[3 * i + 1]), 0);
    assert.ok(lift > 0 && Number.isFinite(lift));
    assert.match(world.status, /^LazyCCD: cpu, 1 soft bodies/);
    assert.ok(world.stats.steps === 1 && world.stats.contacts_vf >= 0);
    world.dispose();
  });
}

test("a fast cloth passes through a pinned one with Bullet alone, and not with LazyCCD", () => {
  const lowest = (collisions) => {
    const world = lazyccd.createWorld({ collisions, gravity: [0, 0, 0] });
    const pinned = [...Array(441).keys()].filter((i) => i % 21 === 0 || i % 21 === 20 || i < 21 || i >= 420);
    const net = world.addSoftBody({ ...cloth(21), pinned });
    const { positions, faces } = cloth(11, 0.2);
    const thrown = world.addSoftBody({ positions: positions.map((x, i) => i % 3 === 1 ? x : x / 2), faces });
    thrown.place(thrown.positions, [...Array(121)].flatMap(() => [0, -40, 0]));
    for (let i = 0; i < 20; ++i) world.step(1 / 60);
    const difference = Math.max(...heights(thrown)) - Math.min(...heights(net));
    world.dispose();
    return difference;
  };
  assert.ok(lowest("bullet") < 0);
  assert.ok(lowest("lazyccd") > 0);
});

test("a moving obstacle pushes; a pinned node follows; a force and a placement act", () => {
  const world = lazyccd.createWorld({ gravity: [0, 0, 0] });
  const plate = world.addRigidBody({ shape: { type: "box", halfExtents: [1, 0.1, 1] }, position: [0, -0.2, 0],
    kinematic: true });
  const body = world.addSoftBody(cloth(9));
  for (let i = 1; i <= 30; ++i) {
    plate.moveTo([0, -0.2 + 0.02 * i, 0]);
    world.step(1 / 60);
  }
  assert.ok(Math.abs(plate.position[1] - 0.4) < 1e-6);
  assert.ok(Math.min(...heights(body)) > 0.5);

  const other = world.addSoftBody({ ...cloth(5, 2), pinned: [12] });
  for (let i = 1; i <= 10; ++i) {
    other.moveNode(12, [0, 2 + 0.1 * i, 0]);
    world.step(1 / 60);
  }
  assert.ok(Math.abs(other.positions[3 * 12 + 1] - 3) < 1e-5);
  world.step(1 / 60);
  assert.ok(Math.abs(other.positions[3 * 12 + 1] - 3) < 1e-5, "the node stays where it was moved to");
  other.unpin(12);
  other.addForce([0, 60, 0]);
  world.step(1 / 60);
  assert.ok(other.velocities[3 * 12 + 1] > 0.5);
  other.place(cloth(5, 7).positions);
  assert.ok(heights(other).every((y) => y === 7));
  other.remove();
  world.step(1 / 60);
  world.dispose();
});

test("every shape stops a rope", () => {
  const shapes = [
    { type: "box", halfExtents: [1, 0.5, 1] }, { type: "sphere", radius: 0.5 },
    { type: "capsule", radius: 0.3, height: 0.4 }, { type: "plane", normal: [0, 1, 0], offset: 0.5 },
    { type: "convex", positions: [-1, -1, -1, 1, -1, -1, -1, -1, 1, 1, -1, 1, -1, 0.5, -1, 1, 0.5, -1, -1, 0.5, 1, 1, 0.5, 1] },
    { type: "mesh", positions: [-1, 0.5, -1, 1, 0.5, -1, -1, 0.5, 1, 1, 0.5, 1], faces: [0, 2, 1, 1, 2, 3] },
  ];
  for (const shape of shapes) {
    const world = lazyccd.createWorld();
    world.addRigidBody({ shape });
    const positions = [...Array(7).keys()].flatMap((i) => [0.1 * (i - 3), 1, 0]);
    const rope = world.addSoftBody({ positions, links: [0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6], friction: 1 });
    for (let i = 0; i < 30; ++i) world.step(1 / 60);
    const middle = rope.positions[3 * 3 + 1];
    assert.ok(middle > 0.45 && middle < 0.75, `${shape.type}: the middle is at ${middle}`);
    world.dispose();
  }
});

test("a heavy box falls on soft tetrahedra, which carry it", () => {
  const world = lazyccd.createWorld({ kind: "deformable" });
  world.addRigidBody({ shape: { type: "plane", normal: [0, 1, 0] } });
  const positions = [];
  for (let i = 0; i < 8; ++i) positions.push((i & 1) - 0.5, ((i & 2) >> 1) + 0.05, ((i & 4) >> 2) - 0.5);
  const tetrahedra = [0, 1, 3, 5, 0, 3, 2, 6, 0, 5, 6, 4, 3, 5, 6, 0, 3, 6, 5, 7];
  // Bullet's elasticity needs positive volumes.
  const at = (i) => positions.slice(3 * i, 3 * i + 3);
  for (let t = 0; t < tetrahedra.length; t += 4) {
    const [a, b, c, d] = tetrahedra.slice(t, t + 4).map(at);
    const [u, v, w] = [b, c, d].map((x) => x.map((y, k) => y - a[k]));
    const volume = u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
      u[2] * (v[0] * w[1] - v[1] * w[0]);
    if (volume < 0) [tetrahedra[t + 2], tetrahedra[t + 3]] = [tetrahedra[t + 3], tetrahedra[t + 2]];
  }
  const faces = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
  const body = world.addSoftBody({ positions, faces, tetrahedra, mass: 2, margin: 0.02,
    elasticity: { mu: 2000, lambda: 2000, damping: 0.02 } });
  const box = world.addRigidBody({ shape: { type: "box", halfExtents: [0.3, 0.1, 0.3] }, position: [0, 1.3, 0],
    mass: 1 });
  for (let i = 0; i < 240; ++i) world.step(1 / 240);
  assert.ok(heights(body).every((y) => y > 0 && y < 1.2));
  assert.ok(box.position[1] > 0.9 && box.position[1] < 1.4, `the box is at ${box.position[1]}`);
  world.dispose();
});

test("views end when the memory grows, and the property gives a new one", () => {
  const world = lazyccd.createWorld();
  const body = world.addSoftBody(cloth(5));
  const view = body.positions;
  assert.equal(view.length, 75);
  const others = [];
  while (view.length > 0 && others.length < 60) others.push(world.addSoftBody(cloth(61)));
  assert.equal(view.length, 0);
  assert.equal(body.positions.length, 75);
  world.dispose();
});

test("bad arguments are exceptions that name the argument", () => {
  const world = lazyccd.createWorld();
  const { positions, faces } = cloth(3);
  const body = world.addSoftBody({ positions, faces });
  const ball = world.addRigidBody({ shape: { type: "sphere", radius: 1 }, position: [0, -5, 0] });
  const soft = (options) => () => world.addSoftBody({ positions, faces, ...options });
  const rigid = (shape, options) => () => world.addRigidBody({ shape, ...options });
  const cases = [
    [() => lazyccd.createWorld({ kind: "soft" }), RangeError, /options\.kind is "soft"/],
    [() => lazyccd.createWorld({ gravity: [0, NaN, 0] }), RangeError, /options\.gravity\[1\] is NaN/],
    [() => lazyccd.createWorld({ gravity: 9.81 }), TypeError, /options\.gravity is not an array/],
    [() => lazyccd.createWorld({ solver: { thicknes: 1 } }), RangeError, /thicknes/],
    [() => lazyccd.createWorld({ solver: { restitution: 2 } }), RangeError, /restitution/],
    [() => lazyccd.createWorld({ solver: { restitution: "1" } }), TypeError, /solver\.restitution/],
    [() => lazyccd.createWorld({ colisions: "bullet" }), TypeError, /no member colisions/],
    [() => world.addSoftBody({}), TypeError, /positions is not an array/],
    [soft({ positions: [] }), RangeError, /positions has 0 numbers/],
    [soft({ positions: [0, 1] }), RangeError, /positions has 2 numbers/],
    [soft({ positions: [0, 1, "2"] }), TypeError, /positions\[2\] is not a number/],
    [soft({ positions: [0, 1, Infinity] }), RangeError, /positions\[2\] is Infinity/],
    [soft({ positions: [0, 1, 1e39] }), RangeError, /positions\[2\]/],
    [soft({ faces: [0, 1, 9] }), RangeError, /faces\[2\] is 9, but there are 9 nodes/],
    [soft({ faces: [0, 1, -1] }), RangeError, /faces\[2\] is -1/],
    [soft({ faces: [0, 1, 1.5] }), RangeError, /faces\[2\] is 1\.5/],
    [soft({ faces: [0, 1, 1] }), RangeError, /faces\[1\] and faces\[2\]/],
    [soft({ faces: [0, 1] }), RangeError, /faces has 2 indices/],
    [soft({ faces: new DataView(new ArrayBuffer(12)) }), TypeError, /faces is not an array/],
    [soft({ pinned: [99] }), RangeError, /pinned\[0\] is 99/],
    [soft({ mass: 0 }), RangeError, /mass is 0/],
    [soft({ mass: "1" }), TypeError, /mass is not a number/],
    [soft({ stiffness: 1.5 }), RangeError, /stiffness is 1\.5/],
    [soft({ iterations: 2.5 }), RangeError, /iterations is 2\.5/],
    [soft({ selfCollision: 1 }), TypeError, /selfCollision/],
    [soft({ springs: { stiffness: 1 } }), TypeError, /springs: the rigid world has none/],
    [soft({ wind: 1 }), TypeError, /no member wind/],
    [rigid(undefined), RangeError, /shape\.type is undefined/],
    [rigid({ type: "torus" }), RangeError, /shape\.type is "torus"/],
    [rigid({ type: "box", halfExtents: [1, 0, 1] }), RangeError, /shape\.halfExtents\[1\] is 0/],
    [rigid({ type: "sphere", radius: -1 }), RangeError, /shape\.radius is -1/],
    [rigid({ type: "plane", normal: [0, 0, 0] }), RangeError, /shape\.normal has no direction/],
    [rigid({ type: "convex", positions: [0, 0, 0] }), RangeError, /shape\.positions/],
    [rigid({ type: "mesh", positions, faces: [] }), RangeError, /shape\.faces/],
    [rigid({ type: "mesh", positions, faces }, { mass: 1 }), RangeError, /mass is 1/],
    [rigid({ type: "sphere", radius: 1 }, { rotation: [0, 0, 0, 2] }), RangeError, /rotation/],
    [rigid({ type: "sphere", radius: 1 }, { position: [0, 0] }), RangeError, /position/],
    [() => world.step(0), RangeError, /seconds is 0/],
    [() => world.step(), TypeError, /seconds is not a number/],
    [() => body.pin(9), RangeError, /node is 9/],
    [() => body.moveNode(0, [0, 0]), RangeError, /position has 2 numbers/],
    [() => body.place([0, 0, 0]), RangeError, /positions has 3 numbers; the body has 9 nodes/],
    [() => body.addForce([1, 2, NaN]), RangeError, /force\[2\] is NaN/],
    [() => { body.margin = -1; }, RangeError, /margin is -1/],
    [() => ball.moveTo([0, 0, 0]), TypeError, /not kinematic/],
  ];
  for (const [act, type, message] of cases)
    assert.throws(act, (error) => error instanceof type && message.test(error.message), String(act) + message);
  // Nothing of that reached the world.
  world.step(1 / 60);
  assert.ok(body.positions.every(Number.isFinite));
  body.remove();
  assert.throws(() => body.positions, /the body is removed/);
  world.dispose();
  world.dispose();
  assert.throws(() => world.step(1), /the world is disposed/);
  assert.throws(() => ball.position, /removed|disposed/);
});

test("two hundred worlds leave no memory behind", () => {
  const grow = (count) => {
    for (let i = 0; i < count; ++i) {
      const world = lazyccd.createWorld({ kind: i % 2 ? "rigid" : "deformable" });
      world.addRigidBody({ shape: { type: "mesh", positions: [-1, 0, -1, 1, 0, -1, 0, 0, 1], faces: [0, 1, 2] } });
      const { positions } = world.addSoftBody(cloth(21, 0.05));
      for (let k = 0; k < 5; ++k) world.step(1 / 60);
      assert.ok(positions.length === 0 || Number.isFinite(positions[0]));
      world.dispose();
    }
    return lazyccd.memoryBytes;
  };
  const before = grow(20);
  assert.equal(grow(180), before);
});

test("a module that cannot be loaded is an error that says so", async () => {
  await assert.rejects(load(new Uint8Array([1, 2, 3])), /WebAssembly/);
  await assert.rejects(load(pathToFileURL(path.join(folder, "nothing.wasm"))), /nothing\.wasm/);
});
