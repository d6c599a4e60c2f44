"""PositionBasedDynamics through its Python package pyPBD: XPBD with a distance constraint for each edge.

The ball and the table are distance fields that meet nodes alone. pyPBD has no contact of cloth with cloth,
so what it does in the scenes "second" and "fold" shows its cost alone.
"""
import tempfile
from importlib import metadata
from pathlib import Path

import numpy
import pypbd
from scenes import BENDING, FRAME, FRICTION, MEMBRANE, RADIUS, THICKNESS

VARIANTS = {
    "pypbd-240": dict(substeps=4, parts=5),  # near pyPBD's defaults: 5 ms in five parts of one iteration
    "pypbd-1200": dict(substeps=20, parts=1),  # the same parts, but contacts are found in each
}
DISTANCE, BENDING_MODEL = 4, 3  # pyPBD's numbers of its models: distance and isometric bending, both XPBD
UP = [0, 2, 1]  # pyPBD's gravity acts along -y

OCTAHEDRON = """o solid
v 1 0 0
v -1 0 0
v 0 1 0
v 0 -1 0
v 0 0 1
v 0 0 -1
f 1 3 5
f 3 2 5
f 2 4 5
f 4 1 5
f 3 1 6
f 2 3 6
f 4 2 6
f 1 4 6
"""  # stands for the mesh that a rigid body must have; nothing collides with it


class Simulator:
    compiles = False

    def __init__(self, scene, substeps, parts):
        self.name = (f"pyPBD {metadata.version('pypbd')}, XPBD, 1/{60 * substeps} s, parts: {parts},"
                     f" solids {THICKNESS / 2} m larger, no contact of cloth with cloth")
        self.substeps = substeps
        self.simulation = pypbd.Simulation.getCurrent()
        self.simulation.initDefault()
        self.model, self.time_step = self.simulation.getModel(), self.simulation.getTimeStep()
        self.detection = pypbd.DistanceFieldCollisionDetection()
        self.time_step.setCollisionDetection(self.model, self.detection)
        self.detection.setTolerance(THICKNESS / 2)
        self.time_step.setValueUInt(pypbd.TimeStepController.NUM_SUB_STEPS, parts)
        pypbd.TimeManager.getCurrent().setTimeStepSize(FRAME / substeps)
        if scene.ball:
            self.solid([0, 0, 0], self.detection.addCollisionSphere, RADIUS + THICKNESS / 2)
        if scene.table:
            self.solid([0, -0.5 + THICKNESS / 2, 0], self.detection.addCollisionBox, [6, 1, 6])
        for cloth in scene.cloths:
            self.cloth(cloth)

    def solid(self, place, add, size):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "solid.obj")
            path.write_text(OCTAHEDRON)
            vertices, mesh = pypbd.OBJLoader.loadObjToMesh(str(path), [1, 1, 1])
        body = self.model.addRigidBody(1.0, vertices, mesh, place)
        body.setMass(0.0)
        body.setFrictionCoeff(FRICTION)
        geometry = body.getGeometry().getVertexData()
        kind = pypbd.CollisionObject.RigidBodyCollisionObjectType
        add(len(self.model.getRigidBodies()) - 1, kind, geometry, 0, geometry.size(), size, False, False)

    def cloth(self, cloth):
        particles = self.model.getParticles()
        first = particles.size()
        mesh = self.model.addTriangleModel(cloth.nodes[:, UP], cloth.faces.ravel().tolist(), testMesh=False)
        mesh.setFrictionCoeff(FRICTION)
        for node in range(first, particles.size()):
            particles.setMass(node, cloth.mass / len(cloth.nodes))
            particles.setVelocity(node, numpy.array(cloth.velocity)[UP])
        self.model.addClothConstraints(mesh, DISTANCE, *[MEMBRANE] * 4, 0.0, 0.0, False, False)
        self.model.addBendingConstraints(mesh, BENDING_MODEL, BENDING)
        number = len(self.model.getTriangleModels()) - 1
        kind = pypbd.CollisionObject.TriangleModelCollisionObjectType
        count = len(cloth.nodes)
        self.detection.addCollisionObjectWithoutGeometry(number, kind, particles, first, count, True)

    def step(self):
        self.time_step.step(self.model)

    def positions(self):
        particles = self.model.getParticles()
        return numpy.array(particles.getVertices(), float).reshape(-1, 3)[: particles.size(), UP]

    def close(self):
        pass
