"""Cases that cost or go wrong in other programs, stock and with LazyCCD.

    python hard_cases.py                     runs all scenes, prints a table

cup: a cloth lies over a mug that stands free, and is pulled off it at 1 m/s.
hand: the fingers of a gripper are reset into a hanging cloth, and untangling is switched off.
grippers: two free boxes hold the corners of a cloth and carry it by their velocity.
crossed: a cloth starts as an eight that crosses itself, and falls.

Each run is a process of its own.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys

import numpy as np

from robots import HERE, STEP, Scene, sheet


class Hard(Scene):
    """A scene whose rigid bodies are watched too."""

    options: dict = {}  # of LazyCCD
    watched: list = []  # bodies whose speeds count

    def __init__(self, p):
        super().__init__(p)
        p.loadURDF("plane.urdf")
        self.fastest_body = self.fastest_turn = 0.0

    def after_step(self):
        for body in self.watched:
            velocity, turning = self.p.getBaseVelocity(body)
            self.fastest_body = max(self.fastest_body, float(np.linalg.norm(velocity)))
            self.fastest_turn = max(self.fastest_turn, float(np.linalg.norm(turning)))

    def figures(self):
        return {"below the ground": int((self.nodes()[:, 2] < 0).sum())}


class Cup(Hard):
    """Two free boxes pull the cloth by its edge; constraints move them."""

    seconds = 2.0

    def __init__(self, p):
        super().__init__(p)
        self.cup = p.loadURDF("objects/mug.urdf", [0, 0, 0.02])
        self.watched = [self.cup]
        points, faces = sheet(21, 0.5, 0.5, lambda x: 0 * x)
        self.load_cloth(points + [0, 0, 0.16], faces, margin=0.004, mass=0.1, friction=0.5)
        self.pulls = []
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.01, 0.01, 0.01])
        for y in (-0.25, 0.25):
            place = [0.265, y, 0.16]
            hand = p.createMultiBody(0.2, box, basePosition=place)
            p.createSoftBodyAnchor(self.cloth, self.node_at([0.25, y, 0.16]), hand, -1)
            self.pulls.append((place, p.createConstraint(hand, -1, -1, -1, p.JOINT_FIXED, None, [0, 0, 0], place)))

    def control(self, time_now):
        for place, constraint in self.pulls:
            x = place[0] + max(0.0, min(time_now - 0.7, 0.8))
            self.p.changeConstraint(constraint, [x, place[1], place[2]], maxForce=50)

    def figures(self):
        height = self.p.getBasePositionAndOrientation(self.cup)[0][2]
        return dict(super().figures(), **{"cup's height": height})


class Hand(Hard):
    """A cloth hangs by its upper edge. The fingers start 1 cm deep in each other, around it, and press with 20 N."""

    seconds = 2.0
    options = dict(untangling_speed=0)

    def __init__(self, p):
        super().__init__(p)
        points, faces = sheet(21, 0.5, 0.5, lambda x: 0 * x)
        hanging = np.stack([points[:, 2], points[:, 1], 0.35 + points[:, 0]], axis=1)
        self.load_cloth(hanging, faces, mass=0.2)
        for y in np.linspace(-0.25, 0.25, 21):
            p.createSoftBodyAnchor(self.cloth, self.node_at([0, y, 0.6]), -1, -1)
        self.robot = p.loadURDF(str(HERE / "gripper.urdf"), [0, 0, 0.68], useFixedBase=True)
        for finger in (1, 2):
            p.resetJointState(self.robot, finger, 0.225)  # 0.22 m is where they meet

    def control(self, time_now):
        for finger in (1, 2):
            self.p.setJointMotorControl2(self.robot, finger, self.p.VELOCITY_CONTROL, targetVelocity=0.5, force=20)


class Grippers(Hard):
    """Free boxes without weight of their own carry a cloth over a block, as some programs of robot learning do."""

    seconds = 2.0

    def __init__(self, p):
        super().__init__(p)
        block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
        p.createMultiBody(0, block, basePosition=[0, 0, 0.1])
        points, faces = sheet(21, 0.5, 0.5, lambda x: 0 * x)
        self.load_cloth(points + [0.5, 0, 0.4], faces, mass=0.2, friction=0.5)
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02, 0.02, 0.02])
        self.watched = []
        for y in (-0.25, 0.25):
            hand = p.createMultiBody(0.5, box, basePosition=[0.25, y, 0.4])
            p.createSoftBodyAnchor(self.cloth, self.node_at([0.25, y, 0.4]), hand, -1)
            self.watched.append(hand)

    def control(self, time_now):
        for hand in self.watched:
            at, _ = self.p.getBasePositionAndOrientation(hand)
            turning = self.p.getBaseVelocity(hand)[1]
            self.p.resetBaseVelocity(hand, [-0.5 if at[0] > -0.4 else 0, 0, 5 * (0.4 - at[2])], turning)

    def figures(self):
        turns = [self.p.getBasePositionAndOrientation(hand)[1] for hand in self.watched]
        angle = max(2 * np.degrees(np.arccos(min(1.0, abs(turn[3])))) for turn in turns)
        return dict(super().figures(), **{"turned by degrees": float(angle)})


class Crossed(Hard):
    """The cloth's section is an eight: two layers cross each other along a line."""

    seconds = 2.0
    n = 31

    def __init__(self, p):
        super().__init__(p)
        points, faces = sheet(self.n, 2 * np.pi * 0.95, 0.6, lambda x: 0 * x)
        angle = points[:, 0]
        eight = np.stack([0.3 * np.sin(angle), points[:, 1], 0.25 + 0.12 * np.sin(2 * angle)], axis=1)
        self.load_cloth(eight, faces, margin=0.004)


SCENES = {"cup": Cup, "hand": Hand, "grippers": Grippers, "crossed": Crossed}


def run(name, lazy):
    """Runs one scene in this process and returns its figures."""
    import pybullet as p

    p.connect(p.DIRECT)
    try:
        if lazy:
            import lazyccd.pybullet

            lazyccd.pybullet.load()
        scene = SCENES[name](p)
        if lazy and scene.options:
            lazyccd.pybullet.options(**scene.options)
        times = scene.run()
        result = dict(scene.figures(), **{"fastest node": scene.highest_speed})
        if scene.watched:
            result.update({"fastest body": scene.fastest_body, "fastest turn": scene.fastest_turn})
        result.update({"ms": float(np.mean(times)), "ms median": float(np.median(times)), "steps": len(times)})
        return result
    finally:
        p.disconnect()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--one", choices=SCENES, help=argparse.SUPPRESS)
    parser.add_argument("--lazy", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(run(arguments.one, arguments.lazy)))
        return
    for name in arguments.scenes:
        for lazy in (False, True):
            command = [sys.executable, __file__, "--one", name] + ["--lazy"] * lazy
            output = subprocess.run(command, stdout=subprocess.PIPE, check=True, universal_newlines=True).stdout
            figures = json.loads(output.splitlines()[-1])
            text = ", ".join(f"{key} {value:.3g}" for key, value in figures.items())
            print(f"{name}, {'with LazyCCD' if lazy else 'stock'}: {text}", flush=True)


if __name__ == "__main__":
    main()
