// Draws a demo in a canvas. One renderer of WebGL draws for all, and its picture is copied.
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Fog, HemisphereLight,
  LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshPhongMaterial, PCFSoftShadowMap, Plane,
  Raycaster, Scene, SphereBufferGeometry, Vector2, Vector3, WebGLRenderer,
} from "./three.module.js";

// Colours of soft bodies in turn, by Okabe and Ito: colour-blind people can tell them apart.
const softColours = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9"];
const edgeMaterial = new LineBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.14 });
const mostContacts = 8192;  // drawn at once

export class View {
  // renderer: of makeRenderer(); shared: the SharedCamera of both sides
  constructor(canvas, renderer, shared) {
    this.canvas = canvas;
    this.picture = canvas.getContext("2d", { alpha: false });
    this.renderer = renderer;
    this.shared = shared;
    this.meshes = [];
    this.raycaster = new Raycaster();

    this.scene = new Scene();
    this.scene.fog = new Fog(0);
    this.scene.add(new HemisphereLight(0xffffff, 0x8c8c8c, 0.66), sun());
    this.marker = goalMarker();
    this.contacts = contactLines();
    this.scene.add(this.marker, this.contacts);
    this.readColours();
  }

  // Takes colours from the style sheet: light or dark.
  readColours() {
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => new Color(style.getPropertyValue(name).trim());
    this.scene.background = colour("--sky");
    this.scene.fog.color = colour("--sky");
    this.solid = colour("--solid").convertSRGBToLinear();
    this.ground = colour("--ground").convertSRGBToLinear();
    this.marker.material.color = colour("--ink").convertSRGBToLinear();
    this.contacts.material.color = colour("--ink").convertSRGBToLinear();
    for (const mesh of this.meshes) mesh.material.color = this.colourOf(mesh);
  }

  // Shows another demo. `faces` of its soft bodies are "smooth" or "flat". Materials are not disposed of:
  // their shaders, once compiled, serve the next scenes.
  show(demo, faces) {
    for (const mesh of this.meshes) {
      this.scene.remove(mesh);
      mesh.traverse((part) => part.geometry.dispose());
    }
    this.demo = demo;
    this.meshes = Array.from({ length: demo.bodyCount() }, (_, body) => this.meshOf(body, faces));
    this.scene.add(...this.meshes);
    this.update();
  }

  meshOf(body, faces) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.demo.positions(body).slice(), 3));
    geometry.setIndex(new BufferAttribute(this.demo.faces(body).slice(), 1));
    const isSoft = this.demo.isSoft(body);
    // Rigid boxes are the ground of their scene.
    const isGround = !isSoft && geometry.attributes.position.count === 8;
    const material = new MeshPhongMaterial({
      side: DoubleSide, shininess: 8, flatShading: isSoft ? faces === "flat" : isGround,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    const mesh = new Mesh(geometry, material);
    Object.assign(mesh.userData, { body, isSoft, isGround });
    material.color = this.colourOf(mesh);
    mesh.frustumCulled = false;
    mesh.castShadow = !isGround;
    mesh.receiveShadow = true;
    if (isSoft) mesh.add(edgeLines(geometry));
    return mesh;
  }

  colourOf(mesh) {
    const { body, isSoft, isGround } = mesh.userData;
    if (isSoft) return new Color(softColours[body % softColours.length]).convertSRGBToLinear();
    return isGround ? this.ground : this.solid;
  }

  // Moves the bodies to where the demo has them.
  update() {
    this.demo.updatePositions();
    this.meshes.forEach((mesh, body) => {
      const { position } = mesh.geometry.attributes;
      position.array.set(this.demo.positions(body));
      position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    });
    const points = this.demo.contactPoints().subarray(0, 6 * mostContacts);
    const { position } = this.contacts.geometry.attributes;
    position.array.set(points);
    position.updateRange.count = points.length;
    position.needsUpdate = true;
    this.contacts.geometry.setDrawRange(0, points.length / 3);
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const drawn = this.renderer.domElement;
    fit(this.renderer, width, height);
    if (this.canvas.width !== drawn.width) this.canvas.width = drawn.width;
    if (this.canvas.height !== drawn.height) this.canvas.height = drawn.height;
    this.shared.setAspect(width / height);
    this.scene.fog.near = this.shared.distance + 0.5;
    this.scene.fog.far = this.shared.distance + 3.5;
    this.renderer.render(this.scene, this.shared.camera);
    this.picture.drawImage(drawn, 0, 0);
  }

  // Returns the soft body and its node at a place of the canvas, or null. `place`: -1 to 1, x and y.
  pick(place) {
    this.raycaster.setFromCamera(place, this.shared.camera);
    for (const mesh of this.meshes) mesh.geometry.computeBoundingSphere();
    const [hit] = this.raycaster.intersectObjects(this.meshes);  // without their edges
    if (!hit || !hit.object.userData.isSoft) return null;
    const { body } = hit.object.userData;
    const corners = [hit.face.a, hit.face.b, hit.face.c];
    const distance = (node) => this.positionOf(body, node).distanceTo(hit.point);
    return { body, node: corners.reduce((a, b) => (distance(a) < distance(b) ? a : b)) };
  }

  // In metres.
  positionOf(body, node) {
    return new Vector3().fromBufferAttribute(this.meshes[body].geometry.attributes.position, node);
  }

  // Returns the point at a place of the canvas, in the plane through `through` that faces the camera.
  pointAt(place, through) {
    const facing = this.shared.camera.getWorldDirection(new Vector3());
    const plane = new Plane().setFromNormalAndCoplanarPoint(facing, through);
    this.raycaster.setFromCamera(place, this.shared.camera);
    return this.raycaster.ray.intersectPlane(plane, new Vector3()) || through;
  }

  showContacts(shown) { this.contacts.visible = shown; }

  // Marks the point to which a node is pulled; null for none.
  mark(point) {
    this.marker.visible = point !== null;
    if (point) this.marker.position.copy(point);
  }
}

// For all views.
export function makeRenderer() {
  const renderer = new WebGLRenderer({ antialias: true });
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.gammaOutput = true;
  renderer.gammaFactor = 2.2;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFSoftShadowMap;
  return renderer;
}

// Width and height in pixels of the page.
function fit(renderer, width, height) {
  const size = renderer.getSize(new Vector2());
  if (size.width !== width || size.height !== height) renderer.setSize(width, height);
}

function sun() {
  const light = new DirectionalLight(0xffffff, 0.58);
  light.position.set(1.5, 5, 2.5);
  light.castShadow = true;
  light.shadow.mapSize.set(1024, 1024);
  Object.assign(light.shadow.camera, { left: -2, right: 2, top: 2, bottom: -2, near: 1, far: 9 });
  light.shadow.bias = -0.003;
  return light;
}

// Shares the positions of the faces.
function edgeLines(geometry) {
  const faces = geometry.index.array;
  const ends = [];
  for (let i = 0; i < faces.length; i += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = faces[i + k], b = faces[i + (k + 1) % 3];
      if (a < b) ends.push(a, b);  // the neighbour has it the other way round
    }
  }
  const edges = new BufferGeometry();
  edges.setAttribute("position", geometry.attributes.position);
  edges.setIndex(ends);
  const lines = new LineSegments(edges, edgeMaterial);
  lines.frustumCulled = false;
  return lines;
}

function goalMarker() {
  const radius = 0.025;  // m
  const material = new MeshBasicMaterial({ depthTest: false });
  const marker = new Mesh(new SphereBufferGeometry(radius, 16, 12), material);
  marker.visible = false;
  marker.renderOrder = 2;
  return marker;
}

function contactLines() {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(6 * mostContacts), 3));
  const lines = new LineSegments(geometry, new LineBasicMaterial({ depthTest: false, fog: false }));
  lines.frustumCulled = false;
  lines.visible = false;
  lines.renderOrder = 1;
  return lines;
}
