"""MuJoCo's flexes: triangles with a radius, elasticity by finite elements.

Integrator, solver, tolerance and time step are those that MuJoCo's modelling guide names for cloth. There
are three ways of contact: rows of the constraint solver, which have friction; "passive", an implicit penalty
force; "ipc", which lets no cloth through. The last two are frictionless and experimental.
"""
import mujoco
import numpy
from scenes import BENDING, FRAME, FRICTION, GRAVITY, MEMBRANE, RADIUS, THICKNESS

VARIANTS = {
    "mujoco-rows": dict(substeps=8),
    "mujoco-passive": dict(substeps=8, contact="passive"),
    "mujoco-ipc": dict(substeps=8, contact="ipc"),
    "mujoco-ipc-240": dict(substeps=4, contact="ipc"),  # longer steps let nothing through either
}
# Thickness of the elastic shell that has the scene's stiffness and flexural rigidity.
SHELL = (12 * BENDING / MEMBRANE) ** 0.5  # m
DAMPING = 0.002  # s, the least of the guide's range


def numbers(array):
    return " ".join(f"{value:.9g}" for value in numpy.ravel(array))


def model_of(scene, timestep, contact):
    flexes = "".join(
        f"""<flexcomp name="cloth{i}" type="direct" dim="2" mass="{cloth.mass}" radius="{THICKNESS / 2}"
              point="{numbers(cloth.nodes)}" element="{numbers(cloth.faces)}">
            <contact condim="3" friction="{FRICTION}" solref="0.01 1" solimp=".95 .99 .0001"
              passive="{'true' if contact == 'passive' else 'false'}"
              selfcollide="{'auto' if scene.folds else 'none'}"/>
            <elasticity young="{MEMBRANE / SHELL}" poisson="0" thickness="{SHELL}" damping="{DAMPING}"
              elastic2d="both"/>
          </flexcomp>"""
        for i, cloth in enumerate(scene.cloths))
    solids = f'<geom type="sphere" size="{RADIUS}" friction="{FRICTION}"/>' if scene.ball else ""
    solids += f'<geom type="box" size="3 3 0.5" pos="0 0 -0.5" friction="{FRICTION}"/>' if scene.table else ""
    return f"""<mujoco>
        <option timestep="{timestep!r}" gravity="0 0 -{GRAVITY}" integrator="discrete" solver="Newton"
          tolerance="1e-6">
          <flag ipc="{'enable' if contact == 'ipc' else 'disable'}"/>
        </option>
        <size memory="1G"/>
        <worldbody>{solids}{flexes}</worldbody>
      </mujoco>"""


class Simulator:
    compiles = False

    def __init__(self, scene, substeps, contact="rows"):
        frictionless = "" if contact == "rows" else " without friction"
        self.name = (f"MuJoCo {mujoco.__version__} flex, contact: {contact}{frictionless}, discrete"
                     f" integrator, Newton, 1/{60 * substeps} s, radius {THICKNESS / 2} m")
        self.substeps = substeps
        self.model = mujoco.MjModel.from_xml_string(model_of(scene, FRAME / substeps, contact))
        self.data = mujoco.MjData(self.model)
        self.data.qvel[:] = numpy.concatenate([numpy.tile(cloth.velocity, len(cloth.nodes))
                                               for cloth in scene.cloths])
        mujoco.mj_forward(self.model, self.data)

    def step(self):
        mujoco.mj_step(self.model, self.data)

    def positions(self):
        # mj_step leaves the positions of nodes where they were before it.
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_flex(self.model, self.data)
        return self.data.flexvert_xpos.copy()

    def close(self):
        pass
