"""LazyCCD in the published wheel of PyBullet: the worlds' life cycle, and cloth that does not pass through."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

p = pytest.importorskip("pybullet")
pybullet_data = pytest.importorskip("pybullet_data")
import lazyccd.pybullet as plugin  # noqa: E402

if not plugin._LIBRARY.exists():
    pytest.skip("the package was built without the plugin library", allow_module_level=True)

DEFORMABLE = p.RESET_USE_DEFORMABLE_WORLD
WORLDS = {
    DEFORMABLE: "on, in a deformable world",
    0: "on, in a soft world",
    p.RESET_USE_REDUCED_DEFORMABLE_WORLD: "this world has reduced deformable bodies",
    p.RESET_USE_DISCRETE_DYNAMICS_WORLD: "this world has no soft bodies",
    DEFORMABLE | p.RESET_USE_SIMPLE_BROADPHASE: "on, in a deformable world",
}
MARGIN = 0.02


class Server:
    """A physics server of its own, with LazyCCD."""

    def __init__(self, load=True):
        self.client = p.connect(p.DIRECT)
        if load:
            plugin.load(self.client)

    def __getattr__(self, name):
        return lambda *args, **keys: getattr(p, name)(*args, physicsClientId=self.client, **keys)

    def reset(self, world=DEFORMABLE, ground=True):
        self.resetSimulation(world)
        self.setAdditionalSearchPath(pybullet_data.getDataPath())
        self.setGravity(0, 0, -10)
        if ground:
            self.loadURDF("plane.urdf")

    def cloth(self, height, self_collision=True, **options):
        return self.loadSoftBody(
            "cloth_z_up.obj",
            basePosition=[0, 0, height],
            scale=0.5,
            mass=1.0,
            useNeoHookean=0,
            useBendingSprings=1,
            useMassSpring=1,
            springElasticStiffness=40,
            springDampingStiffness=0.1,
            useSelfCollision=int(self_collision),
            frictionCoeff=0.5,
            useFaceContact=1,
            collisionMargin=MARGIN,
            **options,
        )

    def steps(self, count):
        for _ in range(count):
            self.stepSimulation()

    def nodes(self, body):
        data = self.getMeshData(body, -1, flags=p.MESH_DATA_SIMULATION_MESH)
        return np.array(data[1])

    def height(self, body):
        return self.nodes(body)[:, 2].mean()

    def status(self):
        return plugin.status(self.client)


@pytest.fixture
def server():
    one = Server()
    yield one
    if p.isConnected(one.client):
        p.disconnect(one.client)


def rests(server, lower, upper):
    """Whether two cloths lie on the ground, one on the other, with their margins between."""
    return (
        server.nodes(lower)[:, 2].min() > 0.5 * MARGIN
        and server.height(upper) > server.height(lower) + MARGIN
        and server.height(upper) < 0.2
    )


@pytest.mark.parametrize("world", [DEFORMABLE, 0])
def test_two_cloths_come_to_rest_one_on_the_other(server, world):
    server.reset(world)
    lower, upper = server.cloth(0.3), server.cloth(0.6)
    server.steps(480)
    assert rests(server, lower, upper)
    assert plugin.stats(total=True, physicsClientId=server.client)["steps"] == 480


def test_the_world_that_exists_when_the_plugin_is_loaded_is_taken_over():
    server = Server(load=False)
    server.reset()
    lower, upper = server.cloth(0.3), server.cloth(0.6)
    server.steps(10)
    plugin.load(server.client)
    plugin.load(server.client)
    server.steps(470)
    assert rests(server, lower, upper)
    server.disconnect()


def test_every_world_after_a_reset_is_taken_over_or_left_alone(server):
    for turn in range(4):
        for world, status in WORLDS.items():
            server.reset(world)
            assert server.status().startswith(status)
            if status.startswith("on"):
                bodies = [server.cloth(0.1), server.cloth(0.2)]
                server.steps(20)
                server.removeBody(bodies[turn % 2])
                server.steps(5)
                assert np.isfinite(server.nodes(bodies[1 - turn % 2])).all()
            else:
                server.loadURDF("r2d2.urdf", [0, 0, 1])
                server.steps(5)


@pytest.mark.parametrize("removed", [0, 1])
def test_contacts_are_gone_with_a_removed_body_until_the_next_step(server, removed):
    server.reset(DEFORMABLE)
    bodies = [server.cloth(0.3), server.cloth(0.32)]
    for _ in range(200):
        server.steps(1)
        if len(plugin.contacts(server.client)):
            break
    assert len(plugin.contacts(server.client))
    server.removeBody(bodies[removed])
    assert len(plugin.contacts(server.client)) == 0
    server.steps(1)
    named = plugin.contacts(server.client)
    assert bodies[removed] not in set(named["body_a"]) | set(named["body_b"])


@pytest.mark.parametrize("world", [DEFORMABLE, 0])
def test_off_and_on_while_it_runs(server, world):
    server.reset(world)
    lower, upper = server.cloth(0.3), server.cloth(0.6)
    for _ in range(3):
        server.steps(10)
        plugin.off(server.client)
        assert server.status() == "off"
        assert len(plugin.contacts(server.client)) == 0
        server.steps(2)
        plugin.on(server.client)
        assert server.status().startswith("on")
    server.steps(450)
    assert rests(server, lower, upper)


def test_off_holds_for_later_worlds(server):
    server.reset()
    plugin.off(server.client)
    server.reset()
    assert server.status() == "off"
    plugin.on(server.client)
    assert server.status().startswith("on")


@pytest.mark.parametrize("world", [DEFORMABLE, 0])
def test_off_has_the_motion_of_stock_pybullet(world):
    heights = []
    for loaded in (False, True):
        server = Server(load=loaded)
        server.reset(world)
        if loaded:
            plugin.off(server.client)
        body = server.cloth(0.3, self_collision=False)
        server.steps(120)
        heights.append(server.nodes(body))
        server.disconnect()
    assert (heights[0] == heights[1]).all()


def test_two_servers_do_not_disturb_each_other(server):
    other = Server()
    for one in (server, other):
        one.reset()
    pairs = [(one, one.cloth(0.3), one.cloth(0.6)) for one in (server, other)]
    plugin.options(other.client, jump_speed=6)
    for _ in range(480):
        server.stepSimulation()
        other.stepSimulation()
    assert all(rests(*pair) for pair in pairs)
    assert (server.nodes(pairs[0][1]) == other.nodes(pairs[1][1])).all()
    assert plugin.options(server.client)["jump_speed"] == 5
    other.disconnect()
    server.steps(5)


def test_fifty_connections_one_after_the_other():
    for _ in range(50):
        server = Server()
        server.reset()
        server.cloth(0.05)
        server.steps(3)
        server.disconnect()


def test_contacts_hold_the_weight_of_the_cloths(server):
    server.reset()
    lower, upper = server.cloth(0.1), server.cloth(0.2)
    server.steps(480)
    found = plugin.contacts(server.client)
    ground = server.getBodyUniqueId(0)
    between = np.isin(found["body_a"], (lower, upper)) & np.isin(found["body_b"], (lower, upper))
    with_ground = (found["body_a"] == ground) | (found["body_b"] == ground)
    assert (between | with_ground).all() and between.any() and with_ground.any()
    up = np.where(found["body_a"] == ground, -1, 1) * found["normal"][:, 2]
    force = (found["impulse"] * up)[with_ground].sum() * 240
    assert abs(force - 20) < 1  # two cloths of 1 kg
    assert np.allclose(np.linalg.norm(found["normal"], axis=1), 1)
    assert (found["impulse"] >= 0).all()
    assert np.allclose(found["weights"].sum(axis=1), 0, atol=1e-6)

    soft = found[between & (found["kind"] == 0)][0]
    face = server.nodes(soft["body_b"])[soft["nodes"][1:]]
    at = -(soft["weights"][1:, None] * face).sum(axis=0)
    assert np.allclose(at, soft["point"], atol=1e-6)


def test_options_have_the_names_of_the_solvers_and_act(server):
    server.reset()
    body = server.cloth(0.1)
    values = plugin.options(server.client, thickness=0.05, threads=1, friction=False, backend="cpu")
    assert values["thickness"] == 0.05 and values["threads"] == 1
    assert values["friction"] is False and values["backend"] == "cpu"
    server.steps(480)
    assert 0.045 < server.nodes(body)[:, 2].min() < 0.06
    server.reset()
    assert plugin.options(server.client)["thickness"] == 0.05
    for wrong in (dict(thicknes=1), dict(thickness="much"), dict(threads=0.5), dict(backend="abacus")):
        with pytest.raises(ValueError):
            plugin.options(server.client, **wrong)


def test_a_saved_state_is_restored(server):
    server.reset()
    server.loadURDF("cube_small.urdf", [0, 0, 0.5])
    lower, upper = server.cloth(0.3), server.cloth(0.6)
    server.steps(200)
    state = server.saveState()
    server.steps(60)
    server.restoreState(state)
    server.steps(300)
    assert np.isfinite(server.nodes(lower)).all() and np.isfinite(server.nodes(upper)).all()
    assert server.nodes(lower)[:, 2].min() > 0


def test_images_and_contact_points_of_pybullet_still_come(server):
    server.reset()
    body = server.cloth(0.1)
    server.loadURDF("cube_small.urdf", [0, 0, 0.5])
    server.steps(30)
    assert server.getCameraImage(32, 32, renderer=p.ER_TINY_RENDERER)[0] == 32
    server.getContactPoints(body)


def test_a_pybullet_of_another_version_is_refused(monkeypatch, server):
    monkeypatch.setattr(plugin.metadata, "version", lambda name: "3.2.5")
    with pytest.raises(RuntimeError, match="pip install pybullet=="):
        plugin.load(server.client)


def test_a_client_that_is_not_connected_is_refused():
    with pytest.raises(RuntimeError, match="not connected"):
        plugin.load(77)


def run_script(text, display=()):
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path))
    command = [*display, sys.executable, "-c", text]
    return subprocess.run(command, env=environment, timeout=120).returncode


def test_a_window_has_the_worlds_with_the_solvers_and_keeps_its_picture():
    display = ["xvfb-run", "-a"] if shutil.which("xvfb-run") else []
    if not display and not os.environ.get("DISPLAY"):
        pytest.skip("there is no display, and no xvfb-run for a virtual one")
    script = """
import pybullet as p, pybullet_data, lazyccd.pybullet as plugin, numpy as np
p.connect(p.GUI)
plugin.load()
for turn in range(3):
    for world, kind in ((p.RESET_USE_DEFORMABLE_WORLD, "deformable"), (0, "soft")):
        p.resetSimulation(world)
        assert plugin.status().startswith("on, in a " + kind), plugin.status()
        p.setAdditionalSearchPath(pybullet_data.getDataPath())
        p.setGravity(0, 0, -10)
        p.loadURDF("plane.urdf")
        bodies = [p.loadSoftBody("cloth_z_up.obj", basePosition=[0, 0, z], scale=0.5, mass=1,
                                 useMassSpring=1, useFaceContact=1, collisionMargin=0.02,
                                 springElasticStiffness=40) for z in (0.1, 0.2)]
        for _ in range(60):
            p.stepSimulation()
        assert len(plugin.contacts()) > 0
        nodes = [np.array(p.getMeshData(b, -1, flags=p.MESH_DATA_SIMULATION_MESH)[1]) for b in bodies]
        assert all(n[:, 2].min() > 0 for n in nodes)
        width, height, image = p.getCameraImage(64, 64, renderer=p.ER_BULLET_HARDWARE_OPENGL)[:3]
        assert len(set(np.array(image).reshape(-1, 4)[:, 0].tolist())) > 1
    plugin.off()
    p.stepSimulation()
    plugin.on()
p.disconnect()
"""
    assert run_script(script, display) == 0


def test_a_program_may_end_without_disconnecting():
    script = """
import pybullet as p, pybullet_data, lazyccd.pybullet as plugin
p.connect(p.DIRECT)
plugin.load()
p.resetSimulation({world})
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.loadURDF("plane.urdf")
p.loadSoftBody("cloth_z_up.obj", useMassSpring=1)
p.stepSimulation()
{last}
"""
    for world in (DEFORMABLE, 0):
        assert run_script(script.format(world=world, last="")) == 0
        assert run_script(script.format(world=world, last="p.disconnect()")) == 0
        last = "p.unloadPlugin(p.loadPlugin(str(plugin._LIBRARY), '_lazyccd')); p.stepSimulation(); p.disconnect()"
        assert run_script(script.format(world=world, last=last)) == 0
