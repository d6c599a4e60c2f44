"""Newton's vertex block descent (SolverVBD), on the CPU.

Substeps and iterations are those of Newton's example cloth_twist; with "dat" the iterations are those of its
example vbd_dat_rigid_soft, whose stiffness of contacts both have. Layers of cloth meet with a truncation of
motion (DAT) in both variants. "dat" truncates the motion at the ball and the table too; otherwise these push
with a penalty force.
"""
import newton
import numpy
import warp
from scenes import BENDING, DENSITY, FRAME, FRICTION, GRAVITY, MEMBRANE, NODES, RADIUS, THICKNESS, WIDTH

VARIANTS = {
    "newton-vbd": dict(substeps=10, iterations=4),
    "newton-vbd-dat": dict(substeps=10, iterations=8, dat=True),
}
STIFFNESS, DAMPING = 2e4, 1e-4  # of contacts
RELAXATION = 0.85  # Newton's default: a node moves by at most half of this, times the range of the search
ROOM = 1.2  # times the fastest flight, so that the truncation does not brake it


class Simulator:
    compiles = True  # kernels, at their first use

    def __init__(self, scene, substeps, iterations, dat=False):
        warp.config.log_level = warp.LOG_WARNING
        self.name = (f"Newton {newton.__version__} VBD, CPU, 1/{60 * substeps} s, {iterations} iterations,"
                     f" self-contact margin {THICKNESS} m, ball and table: {'DAT' if dat else 'penalty'}")
        self.substeps, self.dt = substeps, FRAME / substeps
        # Contacts are searched so far that nothing which moves at this speed is missed or held back.
        reach = ROOM * scene.fastest * self.dt / (0.5 * RELAXATION)
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        surface = newton.ModelBuilder.ShapeConfig(ke=STIFFNESS, kd=DAMPING, mu=FRICTION)
        if scene.ball:
            builder.add_shape_sphere(-1, radius=RADIUS, cfg=surface)
        if scene.table:
            place = warp.transform(warp.vec3(0.0, 0.0, -0.5), warp.quat_identity())
            builder.add_shape_box(-1, xform=place, hx=3.0, hy=3.0, hz=0.5, cfg=surface)
        for cloth in scene.cloths:
            builder.add_cloth_mesh(
                pos=warp.vec3(0.0), rot=warp.quat_identity(), scale=1.0, vel=warp.vec3(*cloth.velocity),
                vertices=[warp.vec3(*node) for node in cloth.nodes], indices=cloth.faces.ravel().tolist(),
                density=DENSITY, tri_ke=MEMBRANE, tri_ka=MEMBRANE, tri_kd=2e-4,
                edge_ke=BENDING / (WIDTH / (NODES - 1)), edge_kd=1e-2, particle_radius=THICKNESS / 2)
        builder.color()
        model = builder.finalize(device="cpu")
        model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = STIFFNESS, DAMPING, FRICTION
        pipeline = newton.CollisionPipeline(
            model, broad_phase="nxn", soft_contact_gap=max(THICKNESS, reach - THICKNESS / 2),
            enable_rigid_soft_full_surface_contact=dat)
        self.solver = newton.solvers.SolverVBD(
            model, iterations=iterations, collision_pipeline=pipeline, rigid_soft_enable_dat=dat,
            particle_enable_self_contact=scene.meets, particle_self_contact_margin=THICKNESS,
            particle_self_contact_gap=max(THICKNESS, reach - THICKNESS),
            particle_vertex_contact_buffer_size=128, particle_edge_contact_buffer_size=256)
        self.before, self.after, self.control = model.state(), model.state(), model.control()

    def step(self):
        self.before.clear_forces()
        self.solver.step(self.before, self.after, self.control, None, self.dt)
        self.before, self.after = self.after, self.before

    def positions(self):
        return self.before.particle_q.numpy().astype(numpy.float64)

    def close(self):
        pass
