"""Tables of costs.md."""
from math import exp, log

from tables.common import count, distinct, number, plain, ratio, read, table, text
from tables.ratios import worst_of_each

RATES = {"60": "1/60 s", "240": "1/240 s"}


@table("costs/worst")
def worst():
    runs = {row["file"]: row for row in read("runs.csv")}
    return ["table", "its worst row", "Bullet, ms", "LazyCCD, ms", "times", "machine", "commit"], [
        [found.table, found.what.replace("0.016666666666666666", "1/60 s"), number(found.bullet), number(found.lazyccd),
         ratio(found.ratio), runs[found.table]["machine"], runs[found.table]["commit"]]
        for found in worst_of_each() if found.ratio > 1]


FRONT = [("", "with", text), ("ms a step", "ms a step", number), ("pass-throughs", "pass-throughs", count)]
plain("costs/drop", "drop/drop.csv", [*FRONT, ("fastest nodes at the end, mm/s (root mean square)", "end speed mm/s", number)])
plain("costs/thrown", "costs/thrown.csv", FRONT)


def steps_of_scenes(source, figure, wanted):
    """One row a scene and world, with both steps. figure: the column of the CSV file that is shown."""
    rows = read(source, **wanted)
    cells = {(row["scene"], row["world"], row["steps a second"]): row for row in rows}
    lines = []
    for scene, world in distinct((row["scene"], row["world"]) for row in rows):
        line = [scene.replace(", untuned", ""), world]
        for rate in RATES:
            row = cells[scene, world, rate]
            bullet, ours = (float(row[f"{side} {figure} ms"]) for side in ("Bullet", "LazyCCD"))
            # The CSV file has thousandths of the scene's unit.
            mm = float(row["Bullet sunk in mm"]) / (100 if "in centimetres" in scene else 1)
            line += [number(bullet), number(ours), ratio(ours / bullet), count(mm)]
        lines.append(line)
    heading = ["scene", "world"]
    for name in RATES.values():
        heading += [f"{name}: Bullet, ms", "LazyCCD, ms", "times", "Bullet sunk in, mm"]
    return heading, lines


@table("costs/untuned")
def untuned():
    return steps_of_scenes("costs/untuned.csv", "median", {})


@table("costs/scenes")
def scenes():
    return steps_of_scenes("costs/scenes.csv", "mean", {"precision": "float"})


def summary(source, figure, groups):
    lines = []
    for world in ("rigid", "deformable"):
        for rate, name in RATES.items():
            rows = read(source, world=world, **{"steps a second": rate})
            for group, is_in in groups.items():
                ratios = [float(row[f"LazyCCD {figure} ms"]) / float(row[f"Bullet {figure} ms"])
                          for row in rows if is_in(row)]
                if ratios:
                    mean = exp(sum(map(log, ratios)) / len(ratios))
                    lines.append([world, name, group, count(len(ratios)), ratio(mean), ratio(max(ratios))])
    return lines


# Bullet alone is wrong where nodes get deeper into a rigid body than half of the margin, which is 0.25 of the unit.
MARGIN_MM = 250
GROUPS = {
    "stays out of rigid bodies": lambda row: float(row["Bullet sunk in mm"]) <= MARGIN_MM / 2,
    "sinks in": lambda row: float(row["Bullet sunk in mm"]) > MARGIN_MM / 2,
}


@table("costs/untuned-summary")
def untuned_summary():
    return (["world", "step", "Bullet alone", "scenes", "times, mean", "largest"],
            summary("costs/untuned.csv", "median", GROUPS))


@table("costs/scenes-summary")
def scenes_summary():
    groups = {name: lambda row, name=name: row["precision"] == name for name in ("float", "double")}
    return (["world", "step", "precision", "scenes", "times, mean", "largest"],
            summary("costs/scenes.csv", "mean", groups))


plain("costs/right", "costs/right.csv", [
    ("scene", "scene", text), ("world", "world", text), ("precision", "precision", text), ("m/s", "m/s", text),
    ("Bullet, ms", "Bullet ms", number), ("LazyCCD, ms", "LazyCCD ms", number),
    ("ratio", lambda row: float(row["LazyCCD ms"]) / float(row["Bullet ms"]), ratio),
    ("1/60 s over 1/240 s", "1/60 s over 1/240 s", text)])

@table("costs/stretch")
def stretch():
    """One row a scene and variant, with the longest link of the run and the time of a step."""
    rows = read("costs/stretch.csv")
    cells = {(row["scene"], row["nodes"], row["amount"], row["steps a second"]): row for row in rows}
    lines = []
    for scene in distinct((row["scene"], row["nodes"], row["amount"]) for row in rows):
        line = list(scene)
        for rate in RATES:
            row = cells[(*scene, rate)]
            line += [row["Bullet longest"], f"**{row['LazyCCD longest']}**" if row["beyond"] else row["LazyCCD longest"],
                     number(row["Bullet ms"]), number(row["LazyCCD ms"])]
        lines.append(line)
    heading = ["scene", "nodes", "m/s, or times its mass"]
    for name in RATES.values():
        heading += [f"{name}: longest link, Bullet", "LazyCCD", "Bullet, ms", "LazyCCD, ms"]
    return heading, lines


plain("costs/links", "costs/links.csv", [
    ("nodes", "nodes", text), ("links", "links", count), ("iterations", "iterations", text),
    ("precision", "precision", text), ("Bullet, us", "Bullet us", number), ("LazyCCD, us", "LazyCCD us", number),
    ("ratio", lambda row: float(row["LazyCCD us"]) / float(row["Bullet us"]), ratio)])

plain("costs/sleepers", "costs/sleepers.csv", [
    ("world", "world", text), ("asleep", "sleepers", count), ("Bullet, ms", "Bullet alone", number),
    ("LazyCCD, ms", "with LazyCCD", number), ("of it LazyCCD's own", "LazyCCD's own part", number)])

plain("costs/islands", "costs/islands.csv", [
    (name, name, text) for name in ("world", "part", "resting", "in an impact", "both", "both / sum")])

plain("costs/spawn", "costs/spawn.csv", [
    ("world", "world", text), ("bodies", "bodies", text), ("Bullet: a step", "Bullet ms", number),
    ("with a new body", "Bullet ms with a new body", number), ("LazyCCD: a step", "LazyCCD ms", number),
    ("with a new body", "LazyCCD ms with a new body", number)])


@table("costs/phases")
def phases():
    rows = read("costs/phases.csv")
    lines = []
    for scene, world in distinct((row["scene"], row["world"]) for row in rows):
        own = [row for row in rows if (row["scene"], row["world"]) == (scene, world)]
        last = own[-1]
        lines.append([scene, world] + [number(value) for value in (
            max(float(row["Bullet alone"]) for row in own), last["Bullet alone"],
            max(float(row["with LazyCCD"]) for row in own), last["with LazyCCD"], last["detect"],
            last["response"])])
    return ["scene", "world", "Bullet: most", "at rest", "LazyCCD: most", "at rest", "of it detection",
            "response"], lines


@table("costs/sizes")
def sizes():
    rows = read("costs/sizes.csv")
    methods = distinct(row["method"] for row in rows)
    lines = []
    for scene, triangles in distinct((row["scene"], row["triangles"]) for row in rows):
        own = {row["method"]: row for row in rows if (row["scene"], row["triangles"]) == (scene, triangles)}
        lines.append([scene.replace(":", ", "), count(triangles)] +
                     [number(own[method]["ms"]) if method in own else "" for method in methods] +
                     [count(own["Bullet alone"]["passed"]) if "Bullet alone" in own else ""])
    return ["scene", "triangles", *methods, "Bullet's pass-throughs"], lines


def threads_table(source):
    rows = read(source)
    counts = distinct((row["program"], row["threads"]) for row in rows)
    known = {"0": "Bullet alone", "1": "1 thread", "-1": "chosen"}
    names = [known.get(threads, f"{threads} threads") for _, threads in counts]
    lines = []
    for scene in distinct(row["scene"] for row in rows):
        own = {(row["program"], row["threads"]): row["total"] for row in rows if row["scene"] == scene}
        lines.append([scene.replace(":", ", ")] + [number(own[key]) for key in counts])
    return ["scene, world, size", *names], lines


@table("costs/threads")
def threads():
    return threads_table("costs/threads.csv")


@table("costs/threads-auto")
def threads_auto():
    return threads_table("costs/threads_auto.csv")


@table("costs/settings")
def settings():
    lines = []
    rows = read("costs/settings.csv")
    for model in distinct(row["model"] for row in rows):
        own = [row for row in rows if row["model"] == model]
        default = next(float(row["ms_total"]) for row in own
                       if (row["volume"], row["front"], row["culling"]) == ("box", "auto", "default"))
        best = min(own, key=lambda row: float(row["ms_total"]))
        lines.append([model, count(best["triangles"]), number(default), number(best["ms_total"]),
                      f"{best['volume']}, front {best['front']}, culling {best['culling']}",
                      ratio(default / float(best["ms_total"])), number(max(float(row["ms_total"]) for row in own))])
    return ["model", "triangles", "default, ms", "best, ms", "the best", "default / best", "worst, ms"], lines
