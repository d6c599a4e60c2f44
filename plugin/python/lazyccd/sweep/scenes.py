"""Scenes of PyBullet that a sweep measures: cloth that flies at something, stock and with LazyCCD.

The cloth falls from where free fall gives it the wanted speed at the impact. The arguments of `run` are the settings.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import numpy as np

AXES: Dict[str, List[Any]] = {
    "scene": ["cloth_on_plane", "cloth_on_cubes", "two_cloths"],
    "solver": ["stock", "lazyccd"],
    "speed": [1, 5, 20],  # m/s
    "dt": [1 / 240, 1 / 60],  # s
    "thickness": [0.005, 0.02],  # collision margin of the cloth, m
    "seed": [0],  # turns and shifts the cloth
}
TIMINGS = ("ms_step", "ms_longest")
NODES = 15  # along a side
WIDTH = 1.0  # m
FAR = 20.0  # m; a node this much farther away than the start means an explosion

Wrong = Callable[[List[np.ndarray]], int]


def write_cloth(path: Path, rng: np.random.Generator) -> None:
    """A square cloth as an OBJ file, turned by a random angle about the vertical axis."""
    x, y = np.meshgrid(*[np.linspace(-WIDTH / 2, WIDTH / 2, NODES)] * 2, indexing="ij")
    angle = rng.uniform(0, np.pi / 2)
    c, s = np.cos(angle), np.sin(angle)
    lines = ["o cloth"] + [f"v {c * a - s * b:.9g} {s * a + c * b:.9g} 0" for a, b in zip(x.ravel(), y.ravel())]
    lines += ["vt 0 0", "vn 0 0 1"]
    for i in range(NODES - 1):
        for j in range(NODES - 1):
            a, b = i * NODES + j + 1, (i + 1) * NODES + j + 1
            lines += [f"f {a}/1/1 {b}/1/1 {a + 1}/1/1", f"f {a + 1}/1/1 {b}/1/1 {b + 1}/1/1"]
    path.write_text("\n".join(lines) + "\n")


class World:
    """A server of its own. `wrong` counts the nodes that ended on the wrong side."""

    def __init__(self, point: Dict[str, Any], threads: int):
        import pybullet as p

        self.p, self.point, self.cloths = p, point, []  # type: ignore[var-annotated]
        self.rng = np.random.default_rng(point["seed"])
        self.client = p.connect(p.DIRECT)
        if point["solver"] == "lazyccd":
            import lazyccd.pybullet

            lazyccd.pybullet.load(self.client)
            lazyccd.pybullet.options(self.client, threads=threads)
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD, physicsClientId=self.client)
        p.setGravity(0, 0, -10, physicsClientId=self.client)
        p.setPhysicsEngineParameter(fixedTimeStep=point["dt"], physicsClientId=self.client)

    def obstacle(self, shape: int, place: Tuple[float, float, float], **size: Any) -> None:
        p = self.p
        number = p.createCollisionShape(shape, physicsClientId=self.client, **size)
        p.createMultiBody(0, number, basePosition=place, physicsClientId=self.client)

    def cloth(self, file: str, height: float) -> None:
        p = self.p
        shift = self.rng.uniform(-0.05, 0.05, 2)
        body = p.loadSoftBody(
            file, basePosition=[*shift, height], mass=1.0, scale=1.0, useMassSpring=1, useBendingSprings=1,
            springElasticStiffness=40, springDampingStiffness=0.1, springDampingAllDirections=1, frictionCoeff=0.5,
            useSelfCollision=1, useFaceContact=1, collisionMargin=self.point["thickness"], physicsClientId=self.client,
        )
        self.cloths.append(body)

    def nodes(self) -> List[np.ndarray]:
        flag = self.p.MESH_DATA_SIMULATION_MESH
        read = self.p.getMeshData
        return [np.array(read(body, -1, flags=flag, physicsClientId=self.client)[1]) for body in self.cloths]


def _fall(speed: float) -> float:
    return 0.05 + speed**2 / 20


def _cloth_on_plane(world: World, file: str) -> Wrong:
    world.obstacle(world.p.GEOM_PLANE, (0, 0, 0), planeNormal=[0, 0, 1])
    world.cloth(file, _fall(world.point["speed"]))
    return lambda cloths: int((cloths[0][:, 2] < 0).sum())


def _cloth_on_cubes(world: World, file: str) -> Wrong:
    places = [(x, y) for x in (-0.3, 0.3) for y in (-0.3, 0.3)]
    world.obstacle(world.p.GEOM_PLANE, (0, 0, -0.4), planeNormal=[0, 0, 1])
    for x, y in places:
        world.obstacle(world.p.GEOM_BOX, (x, y, -0.1), halfExtents=[0.1, 0.1, 0.1])
    world.cloth(file, _fall(world.point["speed"]))

    def wrong(cloths: List[np.ndarray]) -> int:
        nodes = cloths[0]
        inside = nodes[:, 2] < -0.4
        for place in places:
            inside |= (np.abs(nodes - [*place, -0.1]) < 0.1 - 1e-6).all(axis=1)
        return int(inside.sum())

    return wrong


def _two_cloths(world: World, file: str) -> Wrong:
    world.obstacle(world.p.GEOM_PLANE, (0, 0, 0), planeNormal=[0, 0, 1])
    height = _fall(world.point["speed"])
    world.cloth(file, height)
    world.cloth(file, height + 0.15)

    def wrong(cloths: List[np.ndarray]) -> int:
        lower, upper = cloths
        below = sum(int((cloth[:, 2] < 0).sum()) for cloth in cloths)
        return below + int(upper[:, 2].mean() < lower[:, 2].mean()) * len(upper)

    return wrong


SCENES: Dict[str, Callable[[World, str], Wrong]] = {
    "cloth_on_plane": _cloth_on_plane,
    "cloth_on_cubes": _cloth_on_cubes,
    "two_cloths": _two_cloths,
}


def points(axes: Dict[str, List[Any]], **settings: Any) -> Any:
    from itertools import product

    unknown = set(axes["scene"]) - set(SCENES)
    if unknown:
        raise ValueError(f"there is no scene {sorted(unknown)}; there are {', '.join(SCENES)}")
    for values in product(*axes.values()):
        yield dict(zip(axes, values))


def run(point: Dict[str, Any], simulated: float = 0.5, seconds: float = 60, threads: int = 1) -> Dict[str, Any]:
    """Measures one point: falls, then `simulated` seconds from the impact on; at most `seconds` of computing."""
    world = World(point, int(threads))
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "cloth.obj")
            write_cloth(file, world.rng)
            wrong = SCENES[point["scene"]](world, str(file))
        far = FAR + _fall(point["speed"])
        steps = round((point["speed"] / 10 + simulated) / point["dt"])
        times: List[float] = []
        outcome, begin = "ran", time.perf_counter()
        for _ in range(steps):
            start = time.perf_counter()
            world.p.stepSimulation(physicsClientId=world.client)
            times.append(time.perf_counter() - start)
            if time.perf_counter() - begin > seconds:
                outcome = "too slow"
                break
            if len(times) % 10 == 0 and not max(np.abs(n).max() for n in world.nodes()) < far:
                outcome = "exploded"
                break
        return {
            "outcome": outcome,
            "steps": len(times),
            "wrong": wrong(world.nodes()) if outcome == "ran" else None,
            "ms_step": 1e3 * float(np.mean(times)),
            "ms_longest": 1e3 * float(np.max(times)),
        }
    finally:
        world.p.disconnect(physicsClientId=world.client)
