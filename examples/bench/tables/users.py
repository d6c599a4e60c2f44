"""Tables of users.md."""
from tables.common import RESULTS, number, plain, ratio, read, table, text


def faster(row):
    times = row["stock median ms"], row["LazyCCD median ms"]
    return ratio(float(times[1]) / float(times[0])) if all(times) else ""


def lost(side):
    return lambda row: row[f"{side} fastest m/s"] + (f", lost at {row[f'{side} lost at step']}"
                                                      if row[f"{side} lost at step"] else "")


def median_and_longest(side):
    return lambda row: f"{row[f'{side} median ms']}, {row[f'{side} longest ms']}" if row[f"{side} median ms"] else row[side]


plain("users/dedo", "users/dedo.csv", [
    ("task", "task", text), ("nodes", "nodes", text), ("stock: median, longest ms", median_and_longest("stock"), text),
    ("LazyCCD", median_and_longest("LazyCCD"), text), ("ratio of medians", faster, text),
    ("fastest node, m/s: stock", lost("stock"), text), ("LazyCCD", lost("LazyCCD"), text)])

plain("users/ravens", "users/ravens.csv", [
    ("task", "task", text), ("seed", "seed", text), ("stock: median, longest ms", median_and_longest("stock"), text),
    ("LazyCCD", median_and_longest("LazyCCD"), text), ("ratio of medians", faster, text),
    ("fastest node, m/s: stock", "stock fastest m/s", text), ("LazyCCD", "LazyCCD fastest m/s", text),
    ("lowest node, mm: stock", "stock lowest mm", text), ("LazyCCD", "LazyCCD lowest mm", text)])

plain("users/gym", "users/gym.csv", [
    ("task", "task", text), ("stock: median ms", "stock median ms", text), ("LazyCCD", "LazyCCD median ms", text),
    ("ratio", faster, text), ("what happened: stock", "stock", text), ("LazyCCD", "LazyCCD", text)])

plain("users/demos", "users/demos.csv", [
    ("demo", "scene", text), ("world", "world", text), ("pass-throughs: Bullet", "Bullet pass-throughs", text),
    ("LazyCCD", "LazyCCD pass-throughs", text), ("LazyCCD, double", "LazyCCD pass-throughs in double", text),
    ("edges in faces: at the start", "sticking at the start", text), ("at the end: Bullet", "Bullet sticking at the end", text),
    ("LazyCCD", "LazyCCD sticking at the end", text), ("fastest node, m/s: Bullet", "Bullet fastest m/s", text),
    ("LazyCCD", "LazyCCD fastest m/s", text), ("in the last second: Bullet", "Bullet fastest in the last second m/s", text),
    ("LazyCCD", "LazyCCD fastest in the last second m/s", text)])

plain("users/demo-times", "users/demo_times.csv", [
    ("demo", "scene", text), ("times Bullet: median frame", "times Bullet, median frame", text),
    ("processor time", "times Bullet, processor time", text), ("LazyCCD, ms a frame", "LazyCCD ms a frame", text)])

SIMULATORS = {"scene": "scene", "simulator": "simulator", "ms_median": "ms a frame", "ms_worst": "longest",
              "inside_worst": "nodes inside", "pass_throughs": "passed", "intersections_end": "cut at the end",
              "stretch_worst": "stretch", "outcome": "outcome"}


@table("users/simulators")
def simulators():
    """Empty until examples/bench/simulators/compare.py has written its CSV file."""
    if not (RESULTS / "simulators.csv").exists():
        return None
    def cell(value):
        try:
            return number(value)
        except ValueError:
            return value

    rows = read("simulators.csv")
    columns = {name: heading for name, heading in SIMULATORS.items() if name in rows[0]}
    return list(columns.values()), [[cell(row[name]) for name in columns] for row in rows]
