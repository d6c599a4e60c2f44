"""LazyCCD in PyBullet: the worlds' life cycle, and cloth that does not pass through."""

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


def test_two_hundred_worlds_are_taken_over_or_left_alone(server):
    for turn in range(40):
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


def test_what_a_long_life_leaves_in_memory():
    script = """
import os, pybullet as p, pybullet_data
client = p.connect(p.DIRECT)
if {loaded}:
    import lazyccd.pybullet as plugin
    plugin.load()

def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

def live(turns):
    for turn in range(turns):
        for world in (p.RESET_USE_DEFORMABLE_WORLD, 0):
            p.resetSimulation(world)
            p.setAdditionalSearchPath(pybullet_data.getDataPath())
            p.setGravity(0, 0, -10)
            p.loadURDF("plane.urdf")
            for z in (0.05, 0.1):
                body = p.loadSoftBody("cloth_z_up.obj", basePosition=[0, 0, z], scale=0.5, mass=1, useMassSpring=1,
                                      useFaceContact=1, useSelfCollision=1, collisionMargin=0.02)
            for _ in range(10):
                p.stepSimulation()
            if {loaded}:
                plugin.contacts(), plugin.stats(), plugin.status()
                if turn % 10 == 0:
                    plugin.off(), plugin.on()
            p.removeBody(body)

live(20)
before = memory()
live(200)
print(memory() - before)
"""
    grown = []
    for loaded in (False, True):
        output = run_script(script.format(loaded=loaded), capture=True)
        grown.append(float(output.split()[-1]))
    assert grown[1] < grown[0] + 4, grown  # megabytes; a world that stayed would be 400 times its own


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
def test_a_lost_body_is_named_by_number_node_and_reason(server, world):
    server.reset(world)
    lost, other = server.cloth(3), server.cloth(0.3)
    server.steps(1)
    assert plugin.excluded_bodies(server.client) == []
    server.resetBaseVelocity(lost, [0, 0, 1e30])
    server.resetBasePositionAndOrientation(lost, [float("nan"), 0, 3], [0, 0, 0, 1])
    server.steps(240)
    (found,) = plugin.excluded_bodies(server.client)
    assert found.body == lost and found.reason in ("not_finite", "overflow", "unresolved_step")
    assert np.isfinite(server.nodes(other)).all() and server.height(other) < 0.2


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


def test_two_servers_whose_worlds_come_and_go(server):
    other = Server()
    for turn, (world, status) in enumerate(list(WORLDS.items()) * 4):
        one, two = (server, other) if turn % 2 else (other, server)
        one.reset(world)
        two.reset(DEFORMABLE if turn % 3 else 0)
        bodies = [(two, two.cloth(0.1)), (two, two.cloth(0.2))]
        if status.startswith("on"):
            bodies.append((one, one.cloth(0.1)))
        for _ in range(10):
            one.stepSimulation()
            two.stepSimulation()
        assert one.status().startswith(status) and two.status().startswith("on")
        assert all(np.isfinite(who.nodes(body)).all() for who, body in bodies)
        if turn % 5 == 0:
            other.disconnect()
            other = Server()
    other.disconnect()


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


WRONG_OPTIONS = [
    (dict(thicknes=1), "there is no option 'thicknes'"),
    (dict(thickness="much"), "not a number"),
    (dict(thickness="0,05"), "not a number"),
    (dict(thickness=float("nan")), "not a number"),
    (dict(thickness=float("inf")), "not a number"),
    (dict(thickness=""), "not a value"),
    (dict(thickness="0.1 0.2"), "not a value"),
    (dict(threads=0.5), "not a whole number"),
    (dict(threads=-1), "negative"),
    (dict(friction=2), "neither 0 nor 1"),
    (dict(backend="abacus"), "abacus"),
    (dict(restitution=1.5), "out of range"),
    (dict(restitution=-0.1), "out of range"),
    (dict(position_correction=-2), "out of range"),
    (dict(restitution_threshold=-1), "out of range"),
    (dict(rest_speed=-1), "out of range"),
    (dict(rest_damping=-1), "out of range"),
    (dict(untangling_speed=-1), "out of range"),
    (dict(jump_speed=-1), "out of range"),
    (dict(max_impulse_rounds=-1), "out of range"),
    (dict(solver_iterations=-1), "out of range"),
    (dict(max_zone_rounds=-1), "out of range"),
]


@pytest.mark.parametrize("wrong, words", WRONG_OPTIONS)
def test_a_wrong_option_is_an_error_and_changes_nothing(server, wrong, words):
    server.reset()
    before = plugin.options(server.client)
    with pytest.raises(ValueError, match=words):
        plugin.options(server.client, jump_speed=7, **wrong) if "jump_speed" not in wrong else plugin.options(
            server.client, **wrong
        )
    assert plugin.options(server.client) == before
    assert server.status().startswith("on")


def test_all_options_at_once_and_back(server):
    server.reset()
    values = plugin.options(server.client)
    assert plugin.options(server.client, **values) == values
    changed = plugin.options(server.client, thickness=1 / 3, rest_speed=1e-300, max_zone_rounds=7, friction=False)
    assert changed == dict(values, thickness=1 / 3, rest_speed=1e-300, max_zone_rounds=7, friction=False)


def test_numbers_do_not_depend_on_the_locale(server, tmp_path):
    code, names = "de_DE", ["de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"]
    if shutil.which("localedef"):
        subprocess.run(["localedef", "-i", code, "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")], check=False)
    script = """
import locale, sys, pybullet as p, pybullet_data, lazyccd.pybullet as plugin
for name in {names}:
    try:
        locale.setlocale(locale.LC_ALL, name)
        break
    except locale.Error:
        pass
else:
    sys.exit(77)
assert locale.localeconv()["decimal_point"] == ","
p.connect(p.DIRECT)
plugin.load()
p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
values = plugin.options(thickness=0.0125, rest_speed=0.5, threads=1)
assert values["thickness"] == 0.0125 and values["rest_speed"] == 0.5, values
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.loadSoftBody("cloth_z_up.obj", basePosition=[0, 0, 1], mass=1, useMassSpring=1)
p.stepSimulation()
stats = plugin.stats()
assert all(not isinstance(value, str) for value in stats.values()), stats
"""
    variables = dict(LOCPATH=str(tmp_path)) if (tmp_path / "de_DE.UTF-8").exists() else {}
    code = run_script(script.format(names=names), **variables)
    if code == 77:
        pytest.skip("there is no locale with a decimal comma")
    assert code == 0


@pytest.mark.parametrize("world", [DEFORMABLE, 0])
def test_a_saved_state_is_restored_again_and_again(server, world):
    server.reset(world)
    cube = server.loadURDF("cube_small.urdf", [0, 0, 0.5])
    lower, upper = server.cloth(0.3), server.cloth(0.6)
    server.steps(200)
    state, place = server.saveState(), server.getBasePositionAndOrientation(cube)
    for _ in range(5):
        server.steps(60)
        server.restoreState(state)
        assert server.getBasePositionAndOrientation(cube) == place
        assert server.status().startswith("on")
    server.removeState(state)
    server.steps(300)
    assert np.isfinite(server.nodes(lower)).all() and np.isfinite(server.nodes(upper)).all()
    assert server.nodes(lower)[:, 2].min() > 0


def test_bodies_are_removed_in_any_order(server):
    rng = np.random.default_rng(1)
    for world in (DEFORMABLE, 0):
        server.reset(world)
        bodies = []
        for turn in range(60):
            if len(bodies) < 4:
                kind = turn % 3
                place = [0, 0, 0.1 + 0.1 * (turn % 5)]
                bodies.append(server.cloth(place[2]) if kind else server.loadURDF("cube_small.urdf", place))
            server.steps(5)
            if turn % 2:
                server.removeBody(bodies.pop(rng.integers(len(bodies))))
            plugin.contacts(server.client)
        while bodies:
            server.removeBody(bodies.pop())
            server.steps(1)
        assert len(plugin.contacts(server.client)) == 0


def test_images_and_contact_points_of_pybullet_still_come(server):
    server.reset()
    body = server.cloth(0.1)
    server.loadURDF("cube_small.urdf", [0, 0, 0.5])
    server.steps(30)
    assert server.getCameraImage(32, 32, renderer=p.ER_TINY_RENDERER)[0] == 32
    touching = server.getContactPoints(body)
    assert touching
    assert sum(point[9] for point in touching) > 0  # newtons


@pytest.mark.parametrize(
    "installed",
    (
        {"pybullet": "3.2.5"},
        {"pybullet-arm64": "3.2.7"},
        {"pybullet": "3.2.5", "pybullet-arm64": "3.2.8"},
        {},
    ),
)
def test_a_pybullet_of_another_version_is_refused(monkeypatch, server, installed):
    monkeypatch.setattr(plugin, "_installed", lambda: installed)
    with pytest.raises(RuntimeError, match="pip install pybullet=="):
        plugin.load(server.client)


def test_the_fork_and_its_version_are_accepted(monkeypatch, server):
    monkeypatch.setattr(plugin, "_installed", lambda: {"pybullet-arm64": "3.2.8"})
    plugin.load(server.client)


def test_a_client_that_is_not_connected_is_refused():
    with pytest.raises(RuntimeError, match="not connected"):
        plugin.load(77)


def run_script(text, display=(), capture=False, **variables):
    """Runs a program in a process of its own; returns its exit code, or what it printed."""
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path), **variables)
    command = [*display, sys.executable, "-c", text]
    if capture:
        return subprocess.run(
            command, env=environment, timeout=300, check=True, stdout=subprocess.PIPE, universal_newlines=True
        ).stdout
    return subprocess.run(command, env=environment, timeout=300).returncode


@pytest.fixture
def display():
    """A command that gives a program a virtual display; empty if there is a display."""
    if shutil.which("xvfb-run"):
        # -noreset: it stays as it is when its last client leaves, so that the next one finds it.
        return ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset"]
    if not os.environ.get("DISPLAY"):
        pytest.skip("there is no display, and no xvfb-run for a virtual one")
    return []


WINDOW = """
import time, pybullet as p, pybullet_data, lazyccd.pybullet as plugin, numpy as np

def reset(world):
    p.resetSimulation(world)
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    p.setGravity(0, 0, -10)
    p.loadURDF("plane.urdf")

def cloth(z):
    return p.loadSoftBody("cloth_z_up.obj", basePosition=[0, 0, z], scale=0.5, mass=1, useMassSpring=1,
                          useFaceContact=1, collisionMargin=0.02, springElasticStiffness=40)

def nodes(body):
    return np.array(p.getMeshData(body, -1, flags=p.MESH_DATA_SIMULATION_MESH)[1])

WORLDS = {
    p.RESET_USE_DEFORMABLE_WORLD: "on, in a deformable world",
    0: "on, in a soft world",
    p.RESET_USE_REDUCED_DEFORMABLE_WORLD: "this world has reduced deformable bodies",
    p.RESET_USE_DISCRETE_DYNAMICS_WORLD: "this world has no soft bodies",
    p.RESET_USE_DEFORMABLE_WORLD | p.RESET_USE_SIMPLE_BROADPHASE: "on, in a deformable world",
}
p.connect(p.GUI)
plugin.load()
"""


def test_a_window_has_the_worlds_with_the_solvers_and_keeps_its_picture(display):
    script = """
for turn in range(3):
    for world, status in list(WORLDS.items())[:2]:
        reset(world)
        assert plugin.status().startswith(status), plugin.status()
        bodies = [cloth(0.1), cloth(0.2)]
        for _ in range(60):
            p.stepSimulation()
        assert len(plugin.contacts()) > 0
        assert all(nodes(body)[:, 2].min() > 0 for body in bodies)
        width, height, image = p.getCameraImage(64, 64, renderer=p.ER_BULLET_HARDWARE_OPENGL)[:3]
        assert len(set(np.array(image).reshape(-1, 4)[:, 0].tolist())) > 1
p.disconnect()
"""
    assert run_script(WINDOW + script, display) == 0


def test_a_window_whose_worlds_come_and_go(display):
    script = """
for turn in range(8):
    for world, status in WORLDS.items():
        reset(world)
        assert plugin.status().startswith(status), plugin.status()
        if not status.startswith("on"):
            p.stepSimulation()
            continue
        bodies = [cloth(0.1), cloth(0.2)]
        for _ in range(5):
            p.stepSimulation()
        plugin.off()
        assert plugin.status() == "off"
        p.stepSimulation()
        plugin.on()
        state = p.saveState()
        p.removeBody(bodies[turn % 2])
        for _ in range(5):
            p.stepSimulation()
        assert np.isfinite(nodes(bodies[1 - turn % 2])).all()
        p.removeState(state)
for turn in range(3):
    p.disconnect()
    beside = p.connect(p.DIRECT)
    plugin.load(beside)
    p.connect(p.GUI)
    plugin.load(p.connect(p.DIRECT))
    reset(0)
    cloth(0.1)
    p.stepSimulation()
    for client in range(3):
        if p.isConnected(client):
            p.disconnect(client)
    p.connect(p.GUI)
    plugin.load()
    reset(p.RESET_USE_DEFORMABLE_WORLD)
    cloth(0.1)
    p.stepSimulation()
p.disconnect()
"""
    assert run_script(WINDOW + script, display) == 0


def test_statistics_while_a_window_simulates_by_itself(display):
    script = """
import threading
reset(p.RESET_USE_DEFORMABLE_WORLD)
bodies = [cloth(0.1), cloth(0.2)]
p.setRealTimeSimulation(1)
seen, failures, ticks, last = [], [], 0, time.time() + 120

def ask():
    try:
        # At least so long that the window steps, however slow the machine is.
        while (len(seen) < 400 or max(seen) <= 10 or ticks <= 20) and time.time() < last:
            stats, contacts = plugin.stats(total=True), plugin.contacts()
            seen.append(stats["steps"])
            assert np.isfinite(contacts["point"]).all()
            assert set(contacts["body_a"]) | set(contacts["body_b"]) <= {0, *bodies}
    except Exception as failure:
        failures.append(failure)

threads = [threading.Thread(target=ask) for _ in range(2)]
for thread in threads:
    thread.start()
while any(thread.is_alive() for thread in threads):
    assert plugin.status().startswith("on") if ticks % 50 == 49 else not time.sleep(0.001)
    ticks += 1
for thread in threads:
    thread.join()
assert not failures, failures
assert max(seen) > 10, seen
assert ticks > 20
p.disconnect()
"""
    assert run_script(WINDOW + script, display) == 0


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
