"""How many times the time of Bullet alone LazyCCD takes, in every row of every table that compares them."""
from typing import NamedTuple

from tables.common import read


class Found(NamedTuple):
    table: str
    what: str
    bullet: object  # ms, or None
    lazyccd: object  # ms
    ratio: float


def pairs(source, what, bullet, lazyccd, rows=None):
    """The rows of a table with both times in one row."""
    for row in rows or read(source):
        if row[bullet] and row[lazyccd] and float(row[bullet]) > 0:
            times = float(row[bullet]), float(row[lazyccd])
            yield Found(source, ", ".join(row[name] for name in what), *times, times[1] / times[0])


def beside(source, what, key, bullet, time):
    """The rows of a table with Bullet's time in a row of its own: column `key` has the value `bullet` there."""
    rows = read(source)
    alone = {tuple(row[name] for name in what): float(row[time]) for row in rows if row[key] == bullet and row[time]}
    for row in rows:
        scene = tuple(row[name] for name in what)
        if row[key] != bullet and scene in alone and row[time]:
            times = alone[scene], float(row[time])
            yield Found(source, ", ".join((*scene, row[key])), *times, times[1] / times[0])


SCENE = ("scene", "world", "precision", "steps a second")


def all_ratios():
    yield from pairs("costs/untuned.csv", SCENE, "Bullet median ms", "LazyCCD median ms")
    yield from pairs("costs/scenes.csv", SCENE, "Bullet mean ms", "LazyCCD mean ms")
    yield from pairs("costs/right.csv", SCENE[:3], "Bullet ms", "LazyCCD ms")
    yield from pairs("costs/stretch.csv", ("scene", "nodes", "amount", "steps a second"), "Bullet ms", "LazyCCD ms")
    yield from pairs("costs/sleepers.csv", ("world", "sleepers"), "Bullet alone", "with LazyCCD")
    yield from pairs("costs/phases.csv", ("scene", "world", "s"), "Bullet alone", "with LazyCCD")
    yield from pairs("costs/spawn.csv", ("world", "bodies"), "Bullet ms", "LazyCCD ms")
    yield from beside("costs/sizes.csv", ("scene", "triangles"), "method", "Bullet alone", "ms")
    yield from beside("costs/threads.csv", ("scene",), "threads", "0", "total")
    yield from beside("costs/thrown.csv", (), "with", "Bullet alone", "ms a step")
    yield from beside("drop/drop.csv", (), "with", "Bullet alone", "ms a step")
    point = ("scene", "world", "precision", "speed", "dt", "margin", "size")
    yield from beside("failures/map.csv", point, "detector", "bullet", "ms_step")
    for name in ("behaviour/behaviour.csv", "behaviour/behaviour_double.csv"):
        known = [row for row in read(name) if row["Bullet ms a second"] != "crashed"]
        yield from pairs(name, ("scene", "world"), "Bullet ms a second", "LazyCCD ms a second", known)
    yield from beside("behaviour/curve.csv", ("scene", "world", "precision", "substeps"), "collisions", "Bullet", "ms a second")
    for row in read("users/demo_times.csv"):
        yield Found("users/demo_times.csv", row["scene"], None, row["LazyCCD ms a frame"],
                    float(row["times Bullet, median frame"]))
    for task in ("dedo", "ravens", "gym"):
        yield from pairs(f"users/{task}.csv", ("task",), "stock median ms", "LazyCCD median ms")


def worst_of_each():
    """The row with the largest ratio of each table, the largest first."""
    worst = {}
    for found in all_ratios():
        worst[found.table] = max(found, worst.get(found.table, found), key=lambda each: each.ratio)
    return sorted(worst.values(), key=lambda each: -each.ratio)
