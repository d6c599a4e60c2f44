// Uses each part of the package's types; tsc must accept it, and refuse the lines marked as errors.
import load, { isSupported, type Body, type Contacts, type LazyCCD, type Vector } from "../../plugin/javascript/lazyccd";

async function use(): Promise<void> {
  if (!isSupported()) return;
  const lazyccd: LazyCCD = await load(new Uint8Array(8), (line: string) => console.log(line));
  const world = lazyccd.createWorld({ kind: "deformable", gravity: [0, -9.81, 0], solver: { friction: false } });
  const down: Vector = [0, -1, 0];
  const cloth = world.addSoftBody({ positions: new Float32Array(9), faces: [0, 1, 2], springs: { stiffness: 1 } });
  const ball = world.addRigidBody({ shape: { type: "sphere", radius: 1 }, kinematic: true, position: [0, 1, 0] });
  world.step(1 / 240);
  ball.moveTo([0, 2, 0], [0, 0, 0, 1]);
  cloth.margin = 0.02;
  cloth.addForce(down, 0);
  const positions: Float32Array = cloth.positions;
  const contacts: Contacts = world.contacts;
  const bodies: Body[] = [cloth, ball];
  console.log(positions.length, contacts.impulses[0], world.stats.sweeps, world.status, lazyccd.memoryBytes);
  bodies.forEach((body) => body.remove());
  world.dispose();

  // @ts-expect-error: a plane has no radius
  world.addRigidBody({ shape: { type: "plane", radius: 1 } });
  // @ts-expect-error: there is no such kind
  lazyccd.createWorld({ kind: "soft" });
  // @ts-expect-error: views are read, not replaced
  cloth.positions = positions;
}

void use();
