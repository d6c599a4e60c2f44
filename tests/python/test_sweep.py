"""Sweeps: every point is a row once, whatever dies in between."""

import csv
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("ray")
pytest.importorskip("pyarrow")
from lazyccd.sweep import __main__ as command  # noqa: E402
from lazyccd.sweep import driver, read, sweep  # noqa: E402
from lazyccd.sweep.store import Store  # noqa: E402

TASK = '''
import os, signal, time
from pathlib import Path

AXES = {"a": list(range(12)), "b": [0.5, 1.5]}
TIMINGS = ("seconds",)


def run(point, folder="", sleep=0.0, dies=-1, always=0, fails=-1):
    if folder:
        Path(folder, "pid-%d" % os.getpid()).touch()
    if point["a"] == dies:
        died = Path(folder, "died-%s" % point["b"])
        if always or not died.exists():
            died.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    if point["a"] == fails:
        raise ValueError("no such cloth")
    start = time.perf_counter()
    time.sleep(sleep)
    figures = {"outcome": "ran", "sum": point["a"] + point["b"], "seconds": time.perf_counter() - start}
    if point["a"] % 2:
        figures["odd"] = point["a"]
    return figures
'''
POINTS = 24


@pytest.fixture
def task(tmp_path, monkeypatch):
    (tmp_path / "some_task.py").write_text(TASK)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield command.task_of(str(tmp_path / "some_task.py"))
    sys.modules.pop("some_task", None)


def rows(folder):
    return driver.rows_without(read(folder), ["seconds"])


def expected():
    table = []
    for a in range(12):
        for b in (0.5, 1.5):
            table.append(dict(a=a, b=b, outcome="ran", sum=a + b, odd=a if a % 2 else None))
    return table


def is_complete(folder):
    found = sorted(rows(folder), key=lambda row: (row["a"], row["b"]))
    for row in found:
        del row["point"]
    return found == expected()


def test_every_point_is_a_row_once(task, tmp_path):
    told = []
    assert sweep(task, {}, str(tmp_path / "out"), workers=2, progress=lambda *n: told.append(n)) == POINTS
    assert is_complete(tmp_path / "out")
    assert told[0] == (0, POINTS) and told[-1] == (POINTS, POINTS)
    assert sweep(task, {}, str(tmp_path / "out"), workers=2) == 0
    assert len(list((tmp_path / "out").iterdir())) == 1


def test_a_worker_that_dies_changes_no_row(task, tmp_path):
    settings = dict(folder=str(tmp_path), dies=5)
    assert sweep(task, {}, str(tmp_path / "out"), workers=2, settings=settings) == POINTS
    assert (tmp_path / "died-0.5").exists() and (tmp_path / "died-1.5").exists()
    assert is_complete(tmp_path / "out")


def test_workers_that_are_killed_from_outside_change_no_row(task, tmp_path):
    killed = []

    def kill():
        while len(killed) < 3:
            time.sleep(0.2)
            for file in tmp_path.glob("pid-*"):
                pid = int(file.name[4:])
                file.unlink()
                try:
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)
                except ProcessLookupError:
                    pass
                break

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    settings = dict(folder=str(tmp_path), sleep=0.3)
    sweep(task, {}, str(tmp_path / "out"), workers=2, settings=settings, attempts=20)
    assert len(killed) >= 3
    assert is_complete(tmp_path / "out")


def test_a_point_that_always_kills_its_worker_gets_a_row_that_says_so(task, tmp_path):
    settings = dict(folder=str(tmp_path), dies=5, always=1)
    assert sweep(task, {"b": [0.5]}, str(tmp_path / "out"), workers=1, settings=settings) == 12
    outcomes = {row["a"]: row["outcome"] for row in rows(tmp_path / "out")}
    assert outcomes.pop(5) == "worker died"
    assert set(outcomes.values()) == {"ran"} and len(outcomes) == 11


def test_an_exception_of_a_point_is_its_row(task, tmp_path):
    sweep(task, {"b": [0.5]}, str(tmp_path / "out"), workers=1, settings=dict(fails=3))
    outcomes = {row["a"]: row["outcome"] for row in rows(tmp_path / "out")}
    assert outcomes.pop(3) == "error: ValueError: no such cloth"
    assert set(outcomes.values()) == {"ran"}


def test_a_sweep_that_was_killed_goes_on(task, tmp_path):
    out = tmp_path / "out"
    arguments = [sys.executable, "-m", "lazyccd.sweep", str(out), "--task", str(tmp_path / "some_task.py")]
    arguments += ["--workers", "2", "--no-map", "--set", "sleep=0.8"]
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(path for path in sys.path if path))
    first = subprocess.Popen(arguments, env=environment, start_new_session=True)
    limit = time.monotonic() + 300  # a busy machine needs a minute to start Ray
    while not list(out.glob("part-*")) and time.monotonic() < limit:
        time.sleep(0.1)
    os.killpg(first.pid, signal.SIGKILL)  # the driver and its cluster
    first.wait()
    before = len(read(out))
    assert 0 < before < POINTS
    assert sweep(task, {}, str(out), workers=2) == POINTS - before
    assert is_complete(out)


def test_a_row_that_is_on_disk_twice_is_read_once(tmp_path):
    first, second = Store(tmp_path), Store(tmp_path)
    for store in (first, second):
        store.add({"a": 1}, {"sum": 2})
        store.flush()
    assert len(list(tmp_path.iterdir())) == 2
    assert len(read(tmp_path)) == 1
    Store(tmp_path).compact()
    assert len(read(tmp_path)) == 1 and len(list(tmp_path.iterdir())) == 1


def test_a_file_that_was_not_finished_is_no_part(tmp_path):
    (tmp_path / "part-000001.unfinished").write_bytes(b"PAR1 half")
    store = Store(tmp_path)
    store.add({"a": 1}, {})
    store.flush()
    assert len(read(tmp_path)) == 1 and len(list(tmp_path.iterdir())) == 1


def test_an_axis_that_the_task_lacks_is_an_error(task, tmp_path):
    with pytest.raises(ValueError, match="no axis 'c'"):
        sweep(task, {"c": [1]}, str(tmp_path / "out"))


@pytest.mark.parametrize("text, value", [("3", 3), ("0.5", 0.5), ("1/240", 1 / 240), ("fold", "fold"), ("1/0", "1/0")])
def test_values_on_the_command_line(text, value):
    assert command.value_of(text) == value


def has_plugin():
    try:
        import lazyccd.pybullet as plugin
    except ImportError:
        return False
    return plugin._LIBRARY.exists()


@pytest.mark.skipif(not has_plugin(), reason="needs PyBullet and the plugin library")
def test_scenes_of_pybullet_give_a_map(tmp_path):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    arguments = [sys.executable, "-m", "lazyccd.sweep", str(out), "--workers", "2", "--set", "simulated=0.2"]
    arguments += ["--axis", "speed=1,5", "--axis", "thickness=0.01", "--axis", "dt=1/240"]
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(path for path in sys.path if path))
    subprocess.run(arguments, env=environment, check=True, timeout=240)
    assert (out / "map.png").stat().st_size > 1000
    lazy = [row for row in read(out).to_pylist() if row["solver"] == "lazyccd"]
    assert len(lazy) == 6
    assert all(row["outcome"] == "ran" and row["wrong"] == 0 for row in lazy), lazy


BENCH = Path(__file__).resolve().parents[2] / "examples" / "bench"
PROGRAMS = Path(os.environ.get("LAZYCCD_PROGRAM", "/nowhere")).parent


@pytest.mark.skipif(not (PROGRAMS / "lazyccd_double").exists(), reason="needs the project's programs")
def test_the_map_of_the_project_has_equal_rows(tmp_path):
    pytest.importorskip("matplotlib")
    arguments = [sys.executable, str(BENCH / "map.py"), str(PROGRAMS), str(tmp_path / "map")]
    subprocess.run([*arguments, "--quick", "--scenes", "fold,edge-on-edge"], check=True, stdout=subprocess.DEVNULL)
    task = command.task_of(str(BENCH / "map_sweep.py"))
    out = tmp_path / "out"
    axes = {"scene": ["fold", "edge-on-edge"]}
    sweep(task, axes, str(out), workers=2, settings=dict(programs=str(PROGRAMS), quick=1))
    task.draw(read(out), out)

    def rows_of(path):
        with open(path, newline="") as file:
            found = [{n: v for n, v in row.items() if n not in task.TIMINGS} for row in csv.DictReader(file)]
        return sorted(found, key=lambda row: [row[name] for name in task.POINT])

    ours, theirs = rows_of(out / "map.csv"), rows_of(tmp_path / "map" / "map.csv")
    assert len(ours) > 40 and ours == theirs
