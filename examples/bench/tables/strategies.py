"""Tables of strategies.md."""
from tables.common import count, distinct, number, read, table

NAMES = {"lazy_stealing": "lazy stealing", "lazy_stealing_greedy": "greedy", "static_list": "static list",
         "task_stealing": "task stealing", "guided": "guided", "thread_per_query": "one thread a query"}


def by_strategy(rows, column):
    """One row a model and one column a strategy; the best is bold."""
    lines = []
    for model in distinct(row["model"] for row in rows):
        own = {row["strategy"]: row for row in rows if row["model"] == model}
        best = min(own, key=lambda name: float(own[name][column]))
        lines.append([model, count(own[best]["triangles"])] + [
            bold(number(own[name][column]), name == best) if name in own else "" for name in NAMES])
    return ["model", "triangles", *NAMES.values()], lines


def bold(cell, is_best):
    return f"**{cell}**" if is_best else cell


@table("strategies/front")
def front():
    return by_strategy(read("strategies/stages.csv"), "ms_traverse")


@table("strategies/device")
def device():
    return by_strategy(read("strategies/strategies-small.csv") + read("strategies/strategies-large.csv"), "ms_device")


@table("strategies/whole")
def whole():
    return by_strategy(read("strategies/strategies-small.csv") + read("strategies/strategies-large.csv"), "ms_total")


@table("strategies/root")
def root():
    return by_strategy(read("strategies/root-stages.csv"), "ms_traverse")


@table("strategies/steals")
def steals():
    rows = read("strategies/stages.csv") + read("strategies/root-stages.csv")
    return ["model", "start", "strategy", "steals a step", "balancings a step", "idle, %", "memory, MB"], [
        [row["model"], "root" if row["front"] == "off" else "front", NAMES[row["strategy"]], number(row["steals"]),
         number(row["balancings"]), count(100 * float(row["idle_share"])), count(float(row["peak_bytes"]) / 1e6)]
        for row in rows if row["model"] in ("funnel", "cloth-ball", "n-body")]


@table("strategies/work")
def work():
    rows = [row for row in read("strategies/strategies-small.csv") + read("strategies/strategies-large.csv")
            if row["strategy"] == "lazy_stealing"]
    columns = {"front": "front_nodes", "tests of nodes": "tree_tests", "pairs of groups": "group_pairs",
               "candidates": "candidates", "contacts": "contacts"}
    return ["model", "triangles", *columns], [
        [row["model"], count(row["triangles"]), *(count(row[name]) for name in columns.values())] for row in rows]


def by_setting(rows, setting):
    """One row a model and one column a value of the setting: milliseconds of the device; the best is bold."""
    values = distinct(row[setting] for row in rows)
    lines = []
    for model in distinct(row["model"] for row in rows):
        own = {row[setting]: row["ms_device"] for row in rows if row["model"] == model}
        best = min(own, key=lambda name: float(own[name]))
        lines.append([model] + [bold(number(own[name]), name == best) if name in own else "" for name in values])
    return ["model", *(value.replace("_", " ") for value in values)], lines


@table("strategies/volumes")
def volumes():
    return by_setting(read("strategies/volumes.csv", front="auto"), "volume")


@table("strategies/culling")
def culling():
    return by_setting(read("strategies/culling.csv"), "culling")


@table("strategies/sizes")
def sizes():
    """Blocks by chunks; both starts, lazy stealing."""
    lines = []
    for row in read("strategies/sizes.csv"):
        lines.append([row["model"], "front", row["block_size"], row["chunk"], "", number(row["ms_traverse"])])
    for row in read("strategies/stacks.csv", strategy="lazy_stealing"):
        lines.append([row["model"], "root", "", row["chunk"], row["stack"], number(row["ms_traverse"])])
    return ["model", "start", "threads a block", "chunk", "stack", "traversal, ms"], lines
