"""Tables of accuracy.md and failures.md."""
from itertools import product

from map_verdict import verdict
from tables.common import count, distinct, number, percent, plain, read, table, text

POOL = "broad phase"  # the queries that a broad phase yields


@table("accuracy/queries")
def queries():
    rows = read("accuracy/queries.csv", set=POOL, kind="both")
    return ["test", "queries", "touch", "ns a query", "missed", "false", "late"], [
        [f"{row['method']}, {row['precision']}",
         count(row["queries"]), count(row["truly_touching"]), number(row["ns_per_query"]), count(row["missed"]),
         count(row["false_hits"]), count(row["toi_late"]) if int(row["timed"]) else ""]
        for row in sorted(rows, key=lambda row: float(row["ns_per_query"]))]


def missed(row, kind):
    true = int(row[f"true_{kind}"])
    return percent(int(row[f"missed_{kind}"]) / true) if true and int(row[f"missed_{kind}"]) else "0"


plain("accuracy/steps", "accuracy/steps.csv", [
    ("frames", "scene", text), ("faces", "faces", count), ("method", "method", text),
    ("precision", "precision", text), ("threads", "threads", text), ("ms", "median_ms", number),
    ("true VF", "true_vf", count), ("missed VF", lambda row: missed(row, "vf"), text),
    ("true EE", "true_ee", count), ("missed EE", lambda row: missed(row, "ee"), text),
    ("false", lambda row: int(row["false_vf"] or 0) + int(row["false_ee"] or 0), count)])

WORDS = {"dies": "dies", "through": "passes through", "energy": "gains energy", "held": "holds nodes",
         "clean": "clean"}


def verdicts(**wanted):
    found = [verdict(row) for row in read("failures/map.csv", **wanted) if not int(row["initial_intersections"])]
    return {name: found.count(name) for name in WORDS}


DETECTORS = {"bullet": "Bullet alone", "lazyccd": "LazyCCD"}


@table("failures/map")
def failures():
    rows = []
    for detector, world, precision in product(DETECTORS, ("rigid", "deformable"), ("float", "double")):
        found = verdicts(detector=detector, world=world, precision=precision)
        rows.append([DETECTORS[detector], world, precision, *map(count, found.values())])
    return ["", "world", "precision", *WORDS.values()], rows


@table("failures/scenes")
def scenes():
    rows = []
    for scene in distinct(row["scene"] for row in read("failures/map.csv")):
        cells = [scene]
        for detector in DETECTORS:
            found = verdicts(detector=detector, scene=scene)
            cells += [count(found["through"] + found["dies"])]
        rows.append(cells + [count(found["held"]), count(sum(found.values()))])
    return ["scene", "fails: Bullet alone", "LazyCCD", "LazyCCD holds nodes", "points"], rows


plain("failures/held", "failures/map.csv", [
    ("scene", "scene", text), ("world", "world", text), ("precision", "precision", text),
    ("m/s", "speed", text), ("step, s", "dt", number), ("margin, m", "margin", text),
    ("nodes held, over all steps", "failsafe_holds", count), ("Bullet alone: pass-throughs", lambda row: alone(row), count)],
    keep=lambda row: row["detector"] == "lazyccd" and verdict(row) == "held")


def alone(row):
    same = ("scene", "world", "precision", "speed", "dt", "margin", "size")
    return read("failures/map.csv", detector="bullet", **{name: row[name] for name in same})[0]["crossings"]
