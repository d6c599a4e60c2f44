"""Fails if the front page or a guide states a measured number that is not the one in the CSV files of examples/results.

    python3 tests/structure/check_numbers.py [folder of the project]

A check is a page, a piece of its text with {} for each number, and the numbers that the CSV files give. It also
fails if a CSV file has no machine and commit in runs.csv, or if no page links to a file of the results.
"""
import re
import sys
from pathlib import Path

ROOT = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
sys.path.insert(0, str(ROOT / "examples" / "bench"))
from pages import read_runs  # noqa: E402  (after its folder)
from tables.accuracy import verdicts  # noqa: E402
from tables.common import RESULTS, count, number, percent, read  # noqa: E402
from tables.ratios import all_ratios  # noqa: E402

WORDS = {2: "two", 17: "seventeen", 18: "eighteen", 20: "twenty"}
# How the front page calls rows of the tables.
CALLED = {
    "ball and 49 ropes, untuned, rigid, float, 60": "49 ropes and a ball, rigid world, 1/60 s",
    "weight on a cloth, 21, 1000, 30": "cloth under 1 000 times its mass, rigid world, 1/30 s",
}
MARGINS, MAP = "costs/untuned.csv", "failures/map.csv"


def machine(name):
    return read_runs()[name]["machine"]


def none(value):
    return count(value) if int(value) else "none"


def only(rows):
    (row,) = rows
    return row


def drop():
    bullet, ours = read("drop/drop.csv")
    return (number(bullet["ms a step"]), count(bullet["pass-throughs"]), number(ours["ms a step"]),
            none(ours["pass-throughs"]), machine("drop/drop.csv"))


def laid(world):
    scene = "cloth of 31 x 31 on a ball at 0 m/s, voxels of 0.25 m, untuned"
    row = only(read(MARGINS, scene=scene, world=world, precision="float", **{"steps a second": "60"}))
    return number(row["Bullet median ms"]), number(row["LazyCCD median ms"]), machine(MARGINS)


def thrown():
    return (*(number(row["ms a step"]) for row in read("costs/thrown.csv")), machine("costs/thrown.csv"))


def worst(tables):
    found = max((found for found in all_ratios() if found.table in tables), key=lambda found: found.ratio)
    return (CALLED.get(found.what, f"{found.what} of {found.table}"), number(found.bullet), number(found.lazyccd),
            number(found.ratio), machine(found.table))


def worst_margins():
    return worst([MARGINS])


def worst_of_all():
    return worst({each.table for each in all_ratios()})


def demos():
    rows = [row for row in read("users/demos.csv") if not row["scene"].endswith("Placed")]
    passed = [row for row in rows if int(row["LazyCCD pass-throughs"]) and not int(row["sticking at the start"])]
    return (len(rows), count(sum(int(row["Bullet pass-throughs"]) for row in rows)),
            none(sum(int(row["LazyCCD pass-throughs"]) for row in passed)), machine("users/demos.csv"))


def detections():
    bullet = only(read("accuracy/steps.csv", scene="cloth-ball", precision="float"))
    cpu = only(read("accuracy/steps.csv", scene="cloth-ball", method="LazyCCD", threads="1"))
    gpu = next(row for row in read("gpu/detections.csv", backend="cuda", strategy="lazy_stealing", mode="graph")
               if row["scene"].startswith("cloth-ball"))
    true = int(bullet["true_vf"]), int(bullet["true_ee"])
    assert bullet["missed_ee"] == bullet["true_ee"], "Bullet misses every edge-edge contact"
    return (count(bullet["faces"]), count(sum(true)), count(bullet["median_ms"]),
            percent(int(bullet["missed_vf"]) / true[0]), number(cpu["median_ms"]), number(gpu["ms_total"], 2),
            none(int(cpu["missed_vf"]) + int(cpu["missed_ee"])), machine("accuracy/steps.csv"),
            machine("gpu/detections.csv").split(" and ")[0])


def failures():
    found = [verdicts(detector=detector) for detector in ("bullet", "lazyccd")]
    fails = [each["through"] + each["dies"] for each in found]
    return (WORDS[len({row["scene"] for row in read(MAP)})].capitalize(), count(sum(found[0].values())), count(fails[0]),
            none(fails[1]), machine(MAP))


def sliding():
    """How far soft boxes slide at 1/60 s, over Bullet alone; from a table of tests/long."""
    rows = re.findall(r"^\| soft box slides.*?\| ([\d.]+) \| \**([\d.]+)", (ROOT / "tests/long/friction.md").read_text(),
                      re.MULTILINE)
    ratios = [float(ours) / float(bullet) for bullet, ours in rows]
    return number(min(ratios), 2), number(max(ratios), 2)


def dedo():
    rows = read("users/dedo.csv")
    return (WORDS[sum(float(row["LazyCCD median ms"]) < float(row["stock median ms"]) for row in rows)],
            WORDS[sum("Mask" in row["task"] and bool(row["LazyCCD lost at step"]) for row in rows)])


CHECKS = [
    ("README.md", "| Picture above, deformable world, 1/240 s | {}, {} pass-throughs | {}, {} | {} |", drop),
    ("README.md", "| Cloth of 31 x 31 laid on a ball, deformable world, 1/60 s, Bullet's own margins | {} | {} | {} |",
     lambda: laid("deformable")),
    ("README.md", "| The same in the rigid world | {} | {} | {} |", lambda: laid("rigid")),
    ("README.md", "| Cloth thrown at cloth at 2 m/s, rigid world, 1/240 s | {} | {} | {} |", thrown),
    ("README.md", "**Worst with Bullet's own margins:** {} ([table](examples/results/costs.md#with-bullets-own-margins)) | {} "
                  "| {} ({} times) | {} |", worst_margins),
    ("README.md", "**Worst of all:** {} ([table](examples/results/costs.md#in-short)) | {} | {} "
                  "({} times) | {} |", worst_of_all),
    ("README.md", "| {} scenes over speed, step, thickness and triangle size, {} points "
                  "([map](examples/results/failures.md#the-map)) | something passes at {} | at {} | {} |", failures),
    ("README.md", "| Bullet's own {} soft-body demos | {} pass-throughs | {}, but between bodies that start intersecting "
                  "| {} |", demos),
    ("README.md", "| {} faces, {} contacts | {}, misses {} and every edge-edge | one thread {}, GPU {}, misses {} | {}; {} |",
     detections),
    ("plugin/README.md", "In the rigid world at 1/60 s soft boxes slide {} to {} times as far as with Bullet", sliding),
    ("plugin/python/README.md", "The median step is shorter in {}; in {} the balls that carry a mask are lost.", dedo),
]


def text_of(page):
    return " ".join((ROOT / page).read_text(encoding="utf-8").split())


def failures_of_text():
    for page, sentence, values in CHECKS:
        expected = sentence.format(*values())
        if expected in text_of(page):
            continue
        pattern = re.escape(sentence).replace(r"\{\}", "(.{1,80}?)")
        stated = re.search(pattern, text_of(page))
        yield f"{page} says: {stated[0] if stated else 'nothing like it'}\n  the CSV files: {expected}"


def failures_of_files():
    runs = read_runs()
    pages = "".join(text_of(page.relative_to(ROOT)) for page in
                    [*RESULTS.glob("*.md"), ROOT / "README.md", ROOT / "plugin" / "README.md"])
    for path in sorted(RESULTS.rglob("*.*")):
        name = str(path.relative_to(RESULTS))
        if path.suffix == ".csv" and name not in runs and name != "runs.csv":
            yield f"examples/results/runs.csv does not have {name}"
        if path.suffix not in (".md",) and name != "runs.csv" and f"{name})" not in pages:
            yield f"no page links to examples/results/{name}"


def main():
    found = [*failures_of_text(), *failures_of_files()]
    for failure in found:
        print(failure)
    sys.exit(bool(found))


main()
