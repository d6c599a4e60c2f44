"""Runs PyBullet's deformable examples and two cloths that fall on hills, stock and with LazyCCD.

    python deformables.py --data FOLDER              all scenes, one table
    python deformables.py --scenes ball torus        some of them

Each run is a process of its own, without a window. FOLDER has ball.vtk and torus.vtk, which only PyBullet's source
distribution carries: examples/pybullet/gym/pybullet_data. Scenes whose files are missing are left out.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

FAR = 50.0  # metres; a node that is farther away means an explosion


class Scene:
    """A world with its soft bodies, and what counts as a node on the wrong side."""

    def __init__(self, p, data):
        self.p, self.data, self.soft, self.ground = p, data, [], 0.0

    def world(self, ground=None, deformable=True):
        p = self.p
        p.setAdditionalSearchPath(str(self.data))
        if deformable:
            p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
        p.setGravity(0, 0, -10)
        if ground is not None:
            p.loadURDF("plane.urdf", [0, 0, ground])
            self.ground = ground
        if deformable:
            p.setPhysicsEngineParameter(sparseSdfVoxelSize=0.25)

    def cloth(self, place, file="cloth_z_up.obj", **options):
        settings = dict(
            scale=0.5, mass=1.0, useNeoHookean=0, useBendingSprings=1, useMassSpring=1, frictionCoeff=0.5,
            springElasticStiffness=40, springDampingStiffness=0.1, useSelfCollision=0, useFaceContact=1,
        )
        settings.update(options)
        self.soft.append(self.p.loadSoftBody(file, basePosition=place, **settings))
        return self.soft[-1]

    def nodes(self, body):
        flag = self.p.MESH_DATA_SIMULATION_MESH
        return np.array(self.p.getMeshData(body, -1, flags=flag)[1])

    def before_step(self, step):
        """What the example does in the middle."""

    def wrong(self):
        """Number of nodes below the ground."""
        return sum(int((self.nodes(body)[:, 2] < self.ground).sum()) for body in self.soft)


class Ball(Scene):
    files = ["ball.vtk"]

    def build(self):
        self.world(-2)
        self.p.loadURDF("cube.urdf", [0, 3, 2], useMaximalCoordinates=True)
        self.soft.append(
            self.p.loadSoftBody(
                "ball.vtk", basePosition=[0, 0, -1], scale=0.5, mass=0.1, useNeoHookean=1, NeoHookeanMu=20,
                NeoHookeanLambda=20, NeoHookeanDamping=0.001, useSelfCollision=1, frictionCoeff=0.5,
            )
        )


class Torus(Scene):
    files = ["torus.vtk", "torus/torus_textured.obj", "torus_deform.urdf"]

    def build(self):
        self.world(-2)
        self.p.loadURDF("cube.urdf", [0, 3, 2], useMaximalCoordinates=True)
        self.soft.append(
            self.p.loadSoftBody(
                "torus/torus_textured.obj", simFileName="torus.vtk", mass=3, useNeoHookean=1, NeoHookeanMu=180,
                NeoHookeanLambda=600, NeoHookeanDamping=0.01, collisionMargin=0.006, useSelfCollision=1,
                frictionCoeff=0.5, repulsionStiffness=800,
            )
        )
        flags = self.p.URDF_USE_SELF_COLLISION
        self.soft.append(self.p.loadURDF("torus_deform.urdf", [0, 1, 0.5], flags=flags))


class Anchor(Scene):
    files = ["cloth_z_up.obj"]

    def build(self):
        self.world(-2)
        box = self.p.loadURDF("cube.urdf", [0, 1, 2], useMaximalCoordinates=True)
        cloth = self.cloth([0, 0, 2])
        for node in (0, 1):
            self.p.createSoftBodyAnchor(cloth, node, -1, -1)
        self.p.createSoftBodyAnchor(cloth, 3, box, -1, [0.5, -0.5, 0])
        self.p.createSoftBodyAnchor(cloth, 2, box, -1, [-0.5, -0.5, 0])


class Bunny(Scene):
    """load_soft_body.py: in the soft world, and the bunny starts through the ground."""

    files = ["bunny.obj"]

    def build(self):
        self.world(0, deformable=False)
        self.soft.append(self.p.loadSoftBody("bunny.obj"))
        self.p.loadURDF("cube_small.urdf", [1, 0, 1])


class AddRemove(Scene):
    files = ["cloth_z_up.obj"]

    def build(self):
        self.world(-2)
        self.add([0, 0, 1])
        self.add([0, 1, 0])

    def add(self, place):
        self.cloth(place, springDampingAllDirections=1, collisionMargin=0.04)

    def before_step(self, step):
        if step == 160:
            self.p.removeBody(self.soft.pop())
            self.add([0, 1, 1])
            self.add([0, -1, 1])
        elif step == 320:
            self.soft.clear()
            self.build()


class Cloths(Scene):
    """Two cloths that fall 5 m, at 10 m/s, on hills: a concave mesh of a multi-body, as PyBullet makes it."""

    files: list = []
    n = 31

    def build(self):
        self.folder = tempfile.TemporaryDirectory()
        self.hills, _ = self.grid("hills.obj", 41, 4.0, lambda x, y: 0.25 * np.cos(2.2 * x) * np.cos(2.2 * y))
        self.grid("cloth.obj", self.n, 1.5, lambda x, y: 0 * x)
        self.world()
        shape = self.p.createCollisionShape(
            self.p.GEOM_MESH, fileName=self.folder.name + "/hills.obj",
            flags=self.p.GEOM_FORCE_CONCAVE_TRIMESH,
        )
        self.p.createMultiBody(0, shape)
        for height in (5.3, 5.5):
            self.cloth(
                [0, 0, height], self.folder.name + "/cloth.obj", scale=1.0, springBendingStiffness=0.1,
                springDampingAllDirections=1, useSelfCollision=1, collisionMargin=0.01,
            )

    def grid(self, name, n, width, height):
        x, y = np.meshgrid(*[np.linspace(-width / 2, width / 2, n)] * 2, indexing="ij")
        points = np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1)
        faces = []
        for i in range(n - 1):
            for j in range(n - 1):
                a, b, c, d = i * n + j, i * n + j + 1, (i + 1) * n + j, (i + 1) * n + j + 1
                faces += [(a, c, b), (b, c, d)]
        lines = [f"v {v[0]:.9g} {v[1]:.9g} {v[2]:.9g}" for v in points] + ["vt 0 0", "vn 0 0 1"]
        lines += ["f " + " ".join(f"{k + 1}/1/1" for k in face) for face in faces]
        Path(self.folder.name, name).write_text("o mesh\n" + "\n".join(lines) + "\n")
        return points, np.array(faces)

    def wrong(self):
        """Nodes below the hills, and nodes of the upper cloth that the whole lower one is above."""
        lower, upper = self.nodes(self.soft[0]), self.nodes(self.soft[1])
        below = sum(int((cloth[:, 2] < self.height_of_hills(cloth)).sum()) for cloth in (lower, upper))
        return below + self.below_cloth(upper, lower)

    def height_of_hills(self, points):
        n, width = 41, 4.0
        cell = width / (n - 1)
        u, v = (points[:, 0] + width / 2) / cell, (points[:, 1] + width / 2) / cell
        inside = (u >= 0) & (u < n - 1) & (v >= 0) & (v < n - 1)
        i, j = np.clip(u.astype(int), 0, n - 2), np.clip(v.astype(int), 0, n - 2)
        s, t = u - i, v - j
        h = self.hills[:, 2].reshape(n, n)
        a, b, c, d = h[i, j], h[i, j + 1], h[i + 1, j], h[i + 1, j + 1]
        first = a + s * (c - a) + t * (b - a)
        second = d + (1 - s) * (b - d) + (1 - t) * (c - d)
        return np.where(inside, np.where(s + t <= 1, first, second), -np.inf)

    def below_cloth(self, points, cloth):
        n = self.n
        corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
        faces = np.concatenate(
            [np.stack([corner, corner + n, corner + 1], 1), np.stack([corner + 1, corner + n, corner + n + 1], 1)]
        )
        a, b, c = (cloth[faces[:, k]] for k in range(3))
        area = (b[:, 1] - c[:, 1]) * (a[:, 0] - c[:, 0]) + (c[:, 0] - b[:, 0]) * (a[:, 1] - c[:, 1])
        area = np.where(np.abs(area) < 1e-14, 1e-14, area)
        count = 0
        for q in points:
            s = ((b[:, 1] - c[:, 1]) * (q[0] - c[:, 0]) + (c[:, 0] - b[:, 0]) * (q[1] - c[:, 1])) / area
            t = ((c[:, 1] - a[:, 1]) * (q[0] - c[:, 0]) + (a[:, 0] - c[:, 0]) * (q[1] - c[:, 1])) / area
            on = (s >= 0) & (t >= 0) & (s + t <= 1)
            heights = (s * a[:, 2] + t * b[:, 2] + (1 - s - t) * c[:, 2])[on]
            count += bool(len(heights)) and bool((heights > q[2]).all())
        return count


class FineCloths(Cloths):
    n = 61


class SelfContact(Scene):
    """A ribbon of 10 x 40 nodes falls on its end and folds, as in Bullet's example of deformable self-contact."""

    files: list = []
    across, along = 10, 40

    def build(self):
        self.folder = tempfile.TemporaryDirectory()
        x, z = np.meshgrid(np.linspace(-2, 2, self.across), np.linspace(-8, 8, self.along), indexing="ij")
        points = np.stack([x.ravel(), 0 * x.ravel(), z.ravel()], axis=1)
        corner = (np.arange(self.across - 1)[:, None] * self.along + np.arange(self.along - 1)).ravel()
        a, b, c, d = corner, corner + 1, corner + self.along, corner + self.along + 1
        self.faces = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
        lines = [f"v {v[0]:.9g} {v[1]:.9g} {v[2]:.9g}" for v in points] + ["vt 0 0", "vn 0 1 0"]
        lines += ["f " + " ".join(f"{k + 1}/1/1" for k in face) for face in self.faces]
        path = Path(self.folder.name, "ribbon.obj")
        path.write_text("o ribbon\n" + "\n".join(lines) + "\n")
        self.world(-10)
        self.p.setGravity(0, 0, -100)
        self.cloth(
            [0, 0, 0], str(path), scale=1.0, springElasticStiffness=10, springDampingStiffness=0.2,
            springDampingAllDirections=1, springBendingStiffness=10, frictionCoeff=0.2, useSelfCollision=1,
            collisionMargin=0.2,
        )
        start = self.nodes(self.soft[0])  # PyBullet numbers the nodes anew
        number = np.array([((start - point) ** 2).sum(axis=1).argmin() for point in points])
        self.faces = number[self.faces]

    def wrong(self):
        """Nodes below the ground, and edges of the ribbon that stick in its faces."""
        x, faces = self.nodes(self.soft[0]), self.faces
        edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        a, b, c = (x[faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        p, q = x[edges[:, 0]], x[edges[:, 1]]
        above = np.einsum("efk,fk->ef", p[:, None] - a, normal)
        below = np.einsum("efk,fk->ef", q[:, None] - a, normal)
        share = above / np.where(above == below, np.inf, above - below)
        hit = (above * below < 0) & ~(edges[:, None, :, None] == faces[None, :, None, :]).any(axis=(2, 3))
        at = p[:, None] + share[:, :, None] * (q - p)[:, None]
        for u, v in ((a, b), (b, c), (c, a)):
            hit &= np.einsum("efk,efk->ef", np.cross(v - u, at - u), np.broadcast_to(normal, at.shape)) > 0
        return super().wrong() + int(hit.sum())


SCENES = {
    "ball": ("deformable_ball", Ball),
    "torus": ("deformable_torus", Torus),
    "anchor": ("deformable_anchor", Anchor),
    "bunny": ("load_soft_body", Bunny),
    "add_remove": ("cloths added and removed", AddRemove),
    "cloths31": ("two cloths 31 x 31 at 10 m/s", Cloths),
    "self_contact": ("deformable self-contact", SelfContact),
    "cloths61": ("two cloths 61 x 61 at 10 m/s", FineCloths),
}


def run(name, data, steps, limit, lazy):
    """Runs one scene in this process and prints its figures as JSON."""
    import pybullet as p

    p.connect(p.DIRECT)
    if lazy:
        import lazyccd.pybullet

        lazyccd.pybullet.load()
    scene = SCENES[name][1](p, data)
    scene.build()
    times, begin, exploded = [], time.perf_counter(), None
    for step in range(steps):
        scene.before_step(step)
        start = time.perf_counter()
        p.stepSimulation()
        times.append(time.perf_counter() - start)
        reach = max(np.abs(scene.nodes(body)).max() for body in scene.soft) if step % 10 == 9 else 0
        if exploded is None and not reach < FAR:
            exploded = step + 1
        if time.perf_counter() - begin > limit:
            break
    milliseconds = 1e3 * np.array(times)
    print(
        json.dumps(
            dict(
                steps=len(times), exploded=exploded, mean=milliseconds.mean(), median=np.median(milliseconds),
                worst=milliseconds.max(), wrong=None if exploded else scene.wrong(),
            )
        )
    )
    p.disconnect()


def measure(name, arguments, lazy):
    command = [sys.executable, __file__, "--one", name, "--data", str(arguments.data)]
    command += ["--steps", str(arguments.steps), "--limit", str(arguments.limit)] + ["--lazy"] * lazy
    output = subprocess.run(command, stdout=subprocess.PIPE, check=True, universal_newlines=True).stdout
    return json.loads(output.splitlines()[-1])


def cell(result, steps):
    text = f"{result['mean']:.3g} ms, at most {result['worst']:.3g}"
    if result["steps"] < steps:
        text += f" (stopped after {result['steps']} steps)"
    if result["exploded"]:
        return f"{text}; explodes by step {result['exploded']}"
    return f"{text}; {result['wrong']} nodes on the wrong side"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of the examples' files")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--steps", type=int, default=480)
    parser.add_argument("--limit", type=float, default=60, help="seconds after which a run is stopped")
    parser.add_argument("--only", choices=("stock", "lazyccd"), help="one of the two")
    parser.add_argument("--one", choices=SCENES, help=argparse.SUPPRESS)
    parser.add_argument("--lazy", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.data is None:
        import pybullet_data

        arguments.data = Path(pybullet_data.getDataPath())
    if arguments.one:
        run(arguments.one, arguments.data, arguments.steps, arguments.limit, arguments.lazy)
        return
    print("| scene | stock | with LazyCCD |\n|---|---|---|")
    for name in arguments.scenes:
        title, scene = SCENES[name]
        if not all((arguments.data / file).exists() for file in scene.files):
            print(f"| {title} | its files are missing | |")
            continue
        cells = [
            "" if arguments.only == other else cell(measure(name, arguments, lazy), arguments.steps)
            for other, lazy in (("lazyccd", False), ("stock", True))
        ]
        print(f"| {title} | {cells[0]} | {cells[1]} |", flush=True)


if __name__ == "__main__":
    main()
