"""Robots that handle cloth in PyBullet, stock and with LazyCCD.

    python robots.py                         runs all scenes, prints a table
    python robots.py --pictures FOLDER       also draws their ends, by PyBullet's own software renderer

gripper: two fingers of a URDF file take a tent of cloth by its ridge and lift it by friction.
press: the Franka Panda of pybullet_data presses a cloth on the table of pybullet_data.
plane, shape: a cloth rests on loadURDF("plane.urdf"), or on a plane as a collision shape.

Each run is a process of its own.
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

HERE = Path(__file__).resolve().parent
STEP = 1 / 240  # s


class Scene:
    """A world with one cloth. `figures` says what came out of it."""

    eye, target, far = [1.6, -1.6, 1.1], [0, 0, 0.4], 4.0
    seconds = 2.0

    def __init__(self, p):
        import pybullet_data

        self.p = p
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
        p.setAdditionalSearchPath(pybullet_data.getDataPath())
        p.setGravity(0, 0, -10)
        self.highest_speed = 0.0

    def load_cloth(self, points, faces, margin=0.005, mass=0.3, friction=1.0):
        """Makes a cloth of an array of points, shape (n, 3), and of faces, shape (f, 3)."""
        with tempfile.TemporaryDirectory() as folder:
            lines = ["o cloth"] + [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points] + ["vt 0 0", "vn 0 0 1"]
            lines += ["f " + " ".join(f"{i + 1}/1/1" for i in face) for face in faces]
            path = Path(folder, "cloth.obj")
            path.write_text("\n".join(lines) + "\n")
            self.cloth = self.p.loadSoftBody(
                str(path), scale=1, mass=mass, useMassSpring=1, useBendingSprings=1, springElasticStiffness=40,
                springDampingStiffness=0.1, springDampingAllDirections=1, springBendingStiffness=0.1,
                frictionCoeff=friction, useSelfCollision=1, useFaceContact=1, collisionMargin=margin,
            )
        nodes = self.nodes()  # PyBullet may join points or number them anew
        self.node_of_point = np.array([((nodes - point) ** 2).sum(axis=1).argmin() for point in np.array(points)])
        self.faces = np.array(faces)

    def nodes(self):
        return np.array(self.p.getMeshData(self.cloth, -1, flags=self.p.MESH_DATA_SIMULATION_MESH)[1])

    def node_at(self, place):
        """The node that is nearest to a place."""
        return int(np.linalg.norm(self.nodes() - place, axis=1).argmin())

    def control(self, time_now):
        """Sets motors."""

    def after_step(self):
        """Reads what lasts for a step only."""

    def run(self):
        times, before = [], self.nodes()
        for step in range(round(self.seconds / STEP)):
            self.control(step * STEP)
            start = time.perf_counter()
            self.p.stepSimulation()
            times.append(1e3 * (time.perf_counter() - start))
            now = self.nodes()
            self.highest_speed = max(self.highest_speed, float(np.linalg.norm(now - before, axis=1).max() / STEP))
            before = now
            self.after_step()
            if not self.highest_speed < 100:
                break
        return times

    def inside(self, body):
        """Nodes that are inside of the boxes, by which a body collides, by more than rounding."""
        p, count = self.p, 0
        inside = np.zeros(len(self.nodes()), bool)
        for link in range(-1, p.getNumJoints(body)):
            if link < 0:
                place, turn = p.getBasePositionAndOrientation(body)
                inertial = p.getDynamicsInfo(body, -1)[3:5]
                place, turn = p.multiplyTransforms(place, turn, *p.invertTransform(*inertial))
            else:
                place, turn = p.getLinkState(body, link, computeForwardKinematics=True)[4:6]
            for shape in p.getCollisionShapeData(body, link):
                if shape[2] != p.GEOM_BOX:
                    continue
                inertial = p.getDynamicsInfo(body, link)[3:5]
                local = p.multiplyTransforms(*inertial, shape[5], shape[6])
                at, by = p.multiplyTransforms(place, turn, *local)
                matrix = np.array(p.getMatrixFromQuaternion(by)).reshape(3, 3)
                half = 0.5 * np.array(shape[3])
                inside |= (np.abs((self.nodes() - at) @ matrix) < half - 1e-4).all(axis=1)
                count += 1
        return int(inside.sum())

    def picture(self, path, width=480, height=360):
        """Draws the world. PyBullet draws one side of the cloth; the other is drawn as a body of its own."""
        p = self.p
        nodes = self.nodes()
        p.changeVisualShape(self.cloth, -1, rgbaColor=[0.25, 0.45, 0.85, 1])
        back = p.createVisualShape(
            p.GEOM_MESH, vertices=nodes.tolist(), indices=self.node_of_point[self.faces][:, ::-1].ravel().tolist(),
            rgbaColor=[0.95, 0.75, 0.3, 1], specularColor=[0, 0, 0],
        )
        p.createMultiBody(0, -1, back)
        view = p.computeViewMatrix(self.eye, self.target, [0, 0, 1])
        lens = p.computeProjectionMatrixFOV(40, width / height, 0.05, self.far)
        pixels = p.getCameraImage(
            2 * width, 2 * height, view, lens, lightDirection=[2, -3, 5], shadow=1, renderer=p.ER_TINY_RENDERER
        )[2]
        from PIL import Image

        image = Image.fromarray(np.array(pixels, np.uint8).reshape(2 * height, 2 * width, 4)[:, :, :3])
        image.resize((width, height), Image.LANCZOS).save(path, quality=80)


def sheet(n, width, depth, height):
    """Points and faces of a cloth of n x n nodes over x and y; `height` is a function of x."""
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, n), np.linspace(-depth / 2, depth / 2, n), indexing="ij")
    faces = []
    for i in range(n - 1):
        for j in range(n - 1):
            a, b = i * n + j, (i + 1) * n + j
            faces += [(a, b, a + 1), (a + 1, b, b + 1)]
    return np.stack([x.ravel(), y.ravel(), height(x).ravel() + 0 * y.ravel()], axis=1), faces


class Gripper(Scene):
    """The fingers close for a second, then the ridge is let go, and the lift rises by 0.4 m."""

    seconds = 3.0
    ridge = 0.37
    eye, target = [1.5, -1.7, 1.1], [0, 0, 0.5]

    def __init__(self, p):
        super().__init__(p)
        self.plane = p.loadURDF("plane.urdf")
        self.load_cloth(*sheet(17, 0.7, 0.6, lambda x: self.ridge - 0.95 * np.abs(x)))
        self.anchors = [
            p.createSoftBodyAnchor(self.cloth, self.node_at([0, y, self.ridge]), -1, -1)
            for y in np.linspace(-0.3, 0.3, 17)
        ]
        self.robot = p.loadURDF(str(HERE / "gripper.urdf"), [0, 0, 0.68], useFixedBase=True)

    def control(self, time_now):
        p = self.p
        if time_now > 1.2 and self.anchors:
            for anchor in self.anchors:
                p.removeConstraint(anchor)
            self.anchors = []
        p.setJointMotorControl2(
            self.robot, 0, p.VELOCITY_CONTROL, targetVelocity=0.4 if 1.4 < time_now < 2.4 else 0, force=200
        )
        for finger in (1, 2):
            p.setJointMotorControl2(self.robot, finger, p.VELOCITY_CONTROL, targetVelocity=0.5, force=20)

    def figures(self):
        nodes = self.nodes()
        return {
            "lifted": float(nodes[:, 2].max() - self.ridge),
            "below the ground": int((nodes[:, 2] < 0).sum()),
            "in the fingers": self.inside(self.robot),
        }


class Press(Scene):
    """A cloth falls on the table; the robot's closed hand comes down on it and presses."""

    seconds = 3.0
    top = 0.6251  # height of the table of pybullet_data, m
    eye, target = [0.95, -0.75, 1.05], [0.05, 0, 0.72]

    def __init__(self, p):
        super().__init__(p)
        p.loadURDF("plane.urdf")
        self.table = p.loadURDF("table/table.urdf", useFixedBase=True)
        self.top = max(p.getAABB(self.table, link)[1][2] for link in range(-1, p.getNumJoints(self.table)))
        points, faces = sheet(21, 0.5, 0.5, lambda x: 0 * x)
        points += [0.1, 0, self.top + 0.05]
        self.load_cloth(points, faces, friction=0.5)
        self.robot = p.loadURDF("franka_panda/panda.urdf", [-0.45, 0, self.top], useFixedBase=True)
        self.rest = [0, 0, 0, -1.6, 0, 1.6, 0.8, 0, 0]
        self.arm = [j for j in range(p.getNumJoints(self.robot)) if p.getJointInfo(self.robot, j)[2] != p.JOINT_FIXED]
        for joint, angle in zip(self.arm, self.rest):
            p.resetJointState(self.robot, joint, angle)

    def control(self, time_now):
        p = self.p
        above = 0.3 - 0.31 * min(1.0, time_now / 1.5)  # of the hand's frame above the table
        angles = p.calculateInverseKinematics(
            self.robot, 11, [0.1, 0, self.top + above], p.getQuaternionFromEuler([np.pi, 0, 0]), restPoses=self.rest,
            lowerLimits=[-2.9] * 9, upperLimits=[2.9] * 9, jointRanges=[5.8] * 9, maxNumIterations=50,
        )
        forces = [87] * 4 + [12] * 3 + [20] * 2
        for joint, angle, force in zip(self.arm[:7], angles, forces):
            p.setJointMotorControl2(self.robot, joint, p.POSITION_CONTROL, angle, force=force, maxVelocity=1.0)
        for joint in self.arm[7:]:
            p.setJointMotorControl2(self.robot, joint, p.POSITION_CONTROL, 0, force=20)

    def figures(self):
        nodes = self.nodes()
        hand = min(self.p.getAABB(self.robot, link)[0][2] for link in range(7, 12))
        return {
            "below the table's top": int((nodes[:, 2] < self.top - 1e-4).sum()),
            "hand above the table": float(hand - self.top),
        }


class Plane(Scene):
    """A cloth of 441 nodes at rest on the ground."""

    seconds = 2.0

    def __init__(self, p):
        super().__init__(p)
        self.ground(p)
        points, faces = sheet(21, 1, 1, lambda x: 0 * x)
        self.load_cloth(points + [0, 0, 0.05], faces)

    def ground(self, p):
        p.loadURDF("plane.urdf")

    def figures(self):
        return {"below the ground": int((self.nodes()[:, 2] < 0).sum())}


class Shape(Plane):
    def ground(self, p):
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE, planeNormal=[0, 0, 1]))


SCENES = {"gripper": Gripper, "press": Press, "plane": Plane, "shape": Shape}


def run(name, lazy, pictures=None):
    """Runs one scene in this process and returns its figures."""
    import pybullet as p

    p.connect(p.DIRECT)
    try:
        if lazy:
            import lazyccd.pybullet

            lazyccd.pybullet.load()
        scene = SCENES[name](p)
        times = scene.run()
        result = dict(scene.figures(), **{"fastest node": scene.highest_speed})
        if lazy:
            found = lazyccd.pybullet.contacts()
            result["contacts"] = len(found)
            if hasattr(scene, "robot"):
                with_robot = (found["body_a"] == scene.robot) | (found["body_b"] == scene.robot)
                result["newtons"] = float(found["impulse"][with_robot].sum() / STEP)
        result["ms"], result["ms longest"] = float(np.mean(times)), float(np.max(times))
        result["steps"] = len(times)
        if pictures:
            scene.picture(Path(pictures) / f"{name}-{'lazyccd' if lazy else 'stock'}.webp")
        return result
    finally:
        p.disconnect()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--pictures", type=Path, help="folder of the pictures")
    parser.add_argument("--one", choices=SCENES, help=argparse.SUPPRESS)
    parser.add_argument("--lazy", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(run(arguments.one, arguments.lazy, arguments.pictures)))
        return
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    for name in arguments.scenes:
        for lazy in (False, True):
            command = [sys.executable, __file__, "--one", name] + ["--lazy"] * lazy
            if arguments.pictures:
                command += ["--pictures", str(arguments.pictures)]
            output = subprocess.run(command, stdout=subprocess.PIPE, check=True, universal_newlines=True).stdout
            figures = json.loads(output.splitlines()[-1])
            text = ", ".join(f"{key} {value:.3g}" for key, value in figures.items() if value is not None)
            print(f"{name}, {'with LazyCCD' if lazy else 'stock'}: {text}", flush=True)


if __name__ == "__main__":
    main()
