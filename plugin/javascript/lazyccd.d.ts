/**
 * Bullet's soft bodies with exact continuous collision detection. Lengths are in metres, times in
 * seconds, masses in kilograms, angles in radians.
 */

export type Vector = readonly [x: number, y: number, z: number];
/** A unit quaternion. */
export type Rotation = readonly [x: number, y: number, z: number, w: number];
export type Numbers = ArrayLike<number>;

/** False if this engine lacks SIMD or exceptions of WebAssembly; then load() rejects. */
export function isSupported(): boolean;

/** Where the module is: its address, its bytes, a response, or a module that is compiled. Default: beside lazyccd.js. */
export type Source = string | URL | Response | Promise<Response> | BufferSource | WebAssembly.Module;

/** Loads the module of WebAssembly. Each call has a memory of its own. `print` gets LazyCCD's messages. */
export default function load(source?: Source, print?: (line: string) => void): Promise<LazyCCD>;

export interface LazyCCD {
  /** Makes an empty world. Throws if an option has a wrong name or value. */
  createWorld(options?: WorldOptions): World;
  /** The size of the module's memory. It grows as needed and never shrinks. */
  readonly memoryBytes: number;
}

export interface WorldOptions {
  /** "rigid": btSoftRigidDynamicsWorld; "deformable": btDeformableMultiBodyDynamicsWorld. Default "rigid". */
  kind?: "rigid" | "deformable";
  /** Who handles the collisions of soft bodies. Default "lazyccd". */
  collisions?: "lazyccd" | "bullet";
  /** m/s². Default [0, -9.81, 0]. */
  gravity?: Vector;
  /** Options of LazyCCD's solver by name, as in plugin/include/lazyccd/bullet/options.h. */
  solver?: Readonly<Record<string, number | boolean>>;
}

export interface SoftBodyOptions {
  /** x, y and z of each node. */
  positions: Numbers;
  /** Three nodes for each triangle. */
  faces?: Numbers;
  /** Two nodes for each link. Default: the edges of faces and tetrahedra. */
  links?: Numbers;
  /** Four nodes for each tetrahedron. */
  tetrahedra?: Numbers;
  /** Nodes that do not move. */
  pinned?: Numbers;
  /** Of the whole body. Default 1. */
  mass?: number;
  /** Two bodies rest at the sum of their margins. Default 0.01. */
  margin?: number;
  /** Of links in the rigid world, 0 to 1. Default 1. */
  stiffness?: number;
  /** Passes over the links in a step of the rigid world: more are stiffer. Default 10. */
  iterations?: number;
  /** Links between nodes this many links apart, 2 or more; they resist bending. Default: none. */
  bending?: number;
  /** Default 0.2. */
  friction?: number;
  /** Share of its velocity that a node loses in a second of the rigid world, 0 to 1. Default 0. */
  damping?: number;
  /** Of a closed body of the rigid world, as Bullet's kPR. Default 0. */
  pressure?: number;
  /** Whether the body collides with itself. Default false. */
  selfCollision?: boolean;
  /** Of the deformable world: springs along the links, N/m and N s/m. */
  springs?: { stiffness: number; damping?: number };
  /** Of the deformable world: elasticity of the tetrahedra, Pa. */
  elasticity?: { mu: number; lambda: number; damping?: number };
}

export type Shape =
  | { type: "box"; halfExtents: Vector }
  | { type: "sphere"; radius: number }
  /** Along y; height is the distance of the two centres. */
  | { type: "capsule"; radius: number; height: number }
  /** Where normal · x = offset. */
  | { type: "plane"; normal: Vector; offset?: number }
  /** The convex hull of points. */
  | { type: "convex"; positions: Numbers }
  /** Triangles; the body does not move or is kinematic. */
  | { type: "mesh"; positions: Numbers; faces: Numbers };

export interface RigidBodyOptions {
  shape: Shape;
  position?: Vector;
  rotation?: Rotation;
  /** 0: the body does not move, unless it is kinematic. Default 0. */
  mass?: number;
  /** The body goes where moveTo() says. Default false. */
  kinematic?: boolean;
  friction?: number;
  margin?: number;
}

/**
 * A world with its bodies. One call of step() is one step of Bullet.
 *
 * Arrays that are read are views of the module's memory. A view ends when the memory grows: with a
 * new body, or in a step with more contacts than ever. It then has length 0. Its contents are those
 * of the last step until its body, or contacts, are read again after another step. So read the
 * property again after each step; that costs nothing worth keeping a view for.
 */
export interface World {
  addSoftBody(options: SoftBodyOptions): SoftBody;
  addRigidBody(options: RigidBodyOptions): RigidBody;
  /** Goes on by `seconds`, above 0. */
  step(seconds: number): void;
  /** Contacts of the last step. Empty with Bullet alone. */
  readonly contacts: Contacts;
  /** Counts and times of the last step, by the names of StepStats in report.h. Empty with Bullet alone. */
  readonly stats: Readonly<Record<string, number>>;
  /** What LazyCCD does in this world, then a line for all that it left out. */
  readonly status: string;
  /** Frees the world and its bodies. All of its views end; using it later throws. */
  dispose(): void;
}

export interface Contacts {
  readonly count: number;
  /** Two numbers of bodies (SoftBody.id) for each contact. */
  readonly bodies: Int32Array;
  /** Four nodes for each contact: a vertex and a face, or two edges. -1: of no soft body. */
  readonly nodes: Int32Array;
  /** 0: a vertex and a face; 1: two edges. */
  readonly kinds: Int32Array;
  /** x, y and z of a point on the second body. */
  readonly points: Float32Array;
  /** Unit vectors from the second body to the first. */
  readonly normals: Float32Array;
  /** N s, along the normals. */
  readonly impulses: Float32Array;
  /** 0 to 1 of the step: when the pair first touched or came near. */
  readonly times: Float32Array;
}

export interface Body {
  /** Its number in the world; never used again. */
  readonly id: number;
  /** Takes the body out of the world. Using it later throws. */
  remove(): void;
}

export interface SoftBody extends Body {
  readonly nodeCount: number;
  /** x, y and z of each node. A view; see World. */
  readonly positions: Float32Array;
  /** m/s. A view; see World. */
  readonly velocities: Float32Array;
  /** Puts all nodes elsewhere; nothing is swept. */
  place(positions: Numbers, velocities?: Numbers): void;
  pin(node: number): void;
  unpin(node: number): void;
  /** Moves a pinned node to `position` in the next step; what is in its way is pushed. */
  moveNode(node: number, position: Vector): void;
  /** Adds a force for the next step, N, to one node or to each. */
  addForce(force: Vector, node?: number): void;
  mass: number;
  margin: number;
  stiffness: number;
  iterations: number;
  friction: number;
  damping: number;
  pressure: number;
  selfCollision: boolean;
}

export interface RigidBody extends Body {
  /** x, y and z. A view; see World. */
  readonly position: Float32Array;
  /** x, y, z and w. A view; see World. */
  readonly rotation: Float32Array;
  /** Of a kinematic body: goes there in the next step, and pushes what is in its way. */
  moveTo(position: Vector, rotation?: Rotation): void;
  /** Puts the body elsewhere; nothing is swept. */
  teleport(position: Vector, rotation?: Rotation): void;
}
