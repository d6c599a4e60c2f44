"""A short life of PyBullet's worlds for check_memory.sh: memory_life.py ROUNDS."""

import sys

import lazyccd
import lazyccd.pybullet as plugin
import numpy as np
import pybullet as p
import pybullet_data

WORLDS = (
    p.RESET_USE_DEFORMABLE_WORLD,
    0,
    p.RESET_USE_REDUCED_DEFORMABLE_WORLD,
    p.RESET_USE_DISCRETE_DYNAMICS_WORLD,
    p.RESET_USE_DEFORMABLE_WORLD | p.RESET_USE_SIMPLE_BROADPHASE,
)


def cloth(height, client):
    return p.loadSoftBody(
        "cloth_z_up.obj", basePosition=[0, 0, height], scale=0.5, mass=1, useMassSpring=1, useBendingSprings=1,
        springElasticStiffness=40, useFaceContact=1, useSelfCollision=1, collisionMargin=0.02, physicsClientId=client,
    )


def steps(count, client):
    for _ in range(count):
        p.stepSimulation(physicsClientId=client)


def live(client, world):
    p.resetSimulation(world, physicsClientId=client)
    p.setAdditionalSearchPath(pybullet_data.getDataPath(), physicsClientId=client)
    p.setGravity(0, 0, -10, physicsClientId=client)
    p.loadURDF("plane.urdf", physicsClientId=client)
    if not plugin.status(client).startswith("on"):
        p.loadURDF("r2d2.urdf", [0, 0, 1], physicsClientId=client)
        return steps(3, client)
    bodies = [cloth(0.03, client), cloth(0.08, client)]
    p.loadURDF("cube_small.urdf", [0, 0, 0.15], physicsClientId=client)
    p.loadURDF("pr2_gripper.urdf", [0, 0.1, 0.3], physicsClientId=client)
    steps(20, client)
    plugin.contacts(client), plugin.stats(True, client), plugin.status(client)
    state = p.saveState(physicsClientId=client)
    plugin.off(client)
    steps(2, client)
    plugin.on(client)
    plugin.options(client, thickness=0.02, threads=2)
    steps(5, client)
    p.restoreState(state, physicsClientId=client)
    p.removeBody(bodies[0], physicsClientId=client)
    plugin.contacts(client)
    steps(5, client)
    try:
        plugin.options(client, thickness="much")
    except ValueError:
        pass


def detect():
    rng = np.random.default_rng(1)
    faces = np.arange(300).reshape(-1, 3)
    start, end = rng.random((2, 300, 3))
    for separation in (0.0, 0.05):
        detector = lazyccd.Detector(faces, separation=separation)
        assert len(detector.detect(start, end)) > 0
        assert len(detector.detect(start.astype(np.float32), end.astype(np.float32))) > 0
    lazyccd.queries.edge_edge(*rng.random((2, 100, 4, 3)))


def main():
    detect()
    for _ in range(int(sys.argv[1])):
        for world in WORLDS:
            first, second = p.connect(p.DIRECT), p.connect(p.DIRECT)
            for client in (first, second):
                plugin.load(client)
            live(first, world)
            live(second, WORLDS[0])
            live(first, WORLDS[1])
            p.disconnect(first)
            live(second, world)
            p.disconnect(second)
    print("lived to the end")


main()
