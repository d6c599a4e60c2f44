"""PyBullet's cloth, with Bullet alone and with LazyCCD.

PyBullet has two soft worlds. In the rigid one (btSoftMultiBodyDynamicsWorld) links are position
constraints, with 20 position iterations, which PyBullet does not let change. There a cloth never meets
itself, because PyBullet sets the flag in the deformable world alone. The deformable world
(btDeformableMultiBodyDynamicsWorld) has springs.

Bullet alone keeps distances to rigid bodies in voxels, of 0.25 m by default. That is coarse for the ball,
so bullet-rigid-240 has smaller ones. In the deformable world their size changes nothing here.
"""
import tempfile
from importlib import metadata
from pathlib import Path

import numpy
import pybullet
from scenes import FRAME, FRICTION, GRAVITY, RADIUS, THICKNESS, Unsupported

VARIANTS = {
    "bullet-rigid-60": dict(substeps=1),
    "bullet-rigid-240": dict(substeps=4, voxel=0.05),
    "bullet-deformable-240": dict(substeps=4, deformable=True),
    "lazyccd-rigid-60": dict(substeps=1, lazy=True),
    "lazyccd-rigid-240": dict(substeps=4, lazy=True),
    "lazyccd-deformable-240": dict(substeps=4, deformable=True, lazy=True),
}
# Springs of the deformable world, in N/m and N s/m. Integrated explicitly; at 200 N/m the cloth explodes.
SPRING = dict(springElasticStiffness=20, springDampingStiffness=0.05, springDampingAllDirections=1,
              springBendingStiffness=0.05, useMassSpring=1, useBendingSprings=1)


class Simulator:
    compiles = False

    def __init__(self, scene, substeps, deformable=False, lazy=False, voxel=0.25):
        if scene.folds and not deformable:
            raise Unsupported("PyBullet's rigid world has no cloth that collides with itself")
        world = "deformable" if deformable else "rigid"
        who = f"LazyCCD {metadata.version('lazyccd')}" if lazy else "Bullet alone"
        self.name = (f"PyBullet {metadata.version('pybullet')}, {who}, {world} world, 1/{60 * substeps} s,"
                     f" margin {THICKNESS / 2} m" + ("" if lazy or deformable else f", voxels of {voxel} m"))
        self.substeps = substeps
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD if deformable else 0)
        if lazy:
            import lazyccd.pybullet

            lazyccd.pybullet.load()
            lazyccd.pybullet.options(threads=1, backend="cpu")
        else:
            pybullet.setPhysicsEngineParameter(sparseSdfVoxelSize=voxel)
        if scene.ball:
            self.obstacle([0, 0, 0], shapeType=pybullet.GEOM_SPHERE, radius=RADIUS)
        if scene.table:
            self.obstacle([0, 0, -0.5], shapeType=pybullet.GEOM_BOX, halfExtents=[3, 3, 0.5])
        self.bodies = [self.cloth(cloth, scene, deformable) for cloth in scene.cloths]
        self.throw(scene)
        pybullet.setGravity(0, 0, -GRAVITY)
        pybullet.setPhysicsEngineParameter(fixedTimeStep=FRAME / substeps, numSubSteps=0)

    def obstacle(self, place, **shape):
        body = pybullet.createMultiBody(0, pybullet.createCollisionShape(**shape), basePosition=place)
        pybullet.changeDynamics(body, -1, lateralFriction=1.0)  # the cloth has the coefficient

    def cloth(self, cloth, scene, deformable):
        lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in cloth.nodes - self.launch(cloth)]
        lines += ["vt 0 0", "vn 0 0 1"]
        lines += ["f " + " ".join(f"{node + 1}/1/1" for node in face) for face in cloth.faces]
        settings = dict(SPRING, useSelfCollision=int(scene.folds), useFaceContact=1) if deformable else {}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "cloth.obj")
            path.write_text("o cloth\n" + "\n".join(lines) + "\n")
            return pybullet.loadSoftBody(str(path), mass=cloth.mass, scale=1.0, collisionMargin=THICKNESS / 2,
                                         frictionCoeff=FRICTION, **settings)

    def launch(self, cloth):
        """Displacement of the step that throws the cloth: PyBullet cannot set the velocity of a soft body."""
        return FRAME * numpy.array(cloth.velocity)

    def throw(self, scene):
        """One step whose gravity gives nodes the first cloth's velocity and moves them to their place.

        It is neither timed nor judged.
        """
        velocity = numpy.array(scene.cloths[0].velocity)
        if velocity.any():
            pybullet.setGravity(*(velocity / FRAME))
            pybullet.setPhysicsEngineParameter(fixedTimeStep=FRAME, numSubSteps=0)
            pybullet.stepSimulation()

    def step(self):
        pybullet.stepSimulation()

    def positions(self):
        flag = pybullet.MESH_DATA_SIMULATION_MESH
        return numpy.concatenate([numpy.array(pybullet.getMeshData(body, -1, flags=flag)[1])
                                  for body in self.bodies])

    def close(self):
        pybullet.disconnect()
