"""Makes a map of where collisions fail: scenes over speed, time step, thickness and triangle size.

map.py PROGRAMS OUT [--quick] [--jobs N] [--scenes A,B] [--detectors A,B] [--draw] [--compare MAP]
  PROGRAMS  folder with the programs lazyccd and lazyccd_double
  OUT       folder of map.csv and of the picture map.png. Points that are already in map.csv are not
            measured again, so a stopped run can be continued.

The detector lazyccd-cuda is LazyCCD on the GPU. It is in the table but not in the picture. At points that
were measured on both CPU and GPU, the two runs are compared: they must be equal to the last bit.

--draw --compare MAP compares OUT/map.csv with another map.csv: all but timings must be equal.
"""
import argparse
import csv
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import product
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)
from matplotlib.collections import PolyCollection  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

from map_verdict import verdict  # noqa: E402

PROGRAMS = {"float": "lazyccd", "double": "lazyccd_double"}
WORLDS = ["rigid", "deformable"]
DETECTORS = {  # options of `lazyccd simulate`, and the name in table and picture
    "bullet": (["--detector", "bullet"], "Bullet alone"),
    "lazyccd": (["--detector", "lazyccd"], "with LazyCCD"),
    "lazyccd-cuda": (["--detector", "lazyccd", "--backend", "cuda"], "LazyCCD on GPU"),
}
DRAWN = ["bullet", "lazyccd"]
STEPS = ["0.016666666666666666", "0.008333333333333333", "0.004166666666666667"]  # s

# Scene: speeds in m/s, time steps in s, margins in m, sizes (factors of the number of nodes along a side).
FULL = {
    "cloth-on-cloth": (["2", "10", "30", "100"], STEPS, ["0.001", "0.01", "0.04"], ["0.5", "1"]),
    "small-triangles": (["0.4", "2", "10"], STEPS, ["0.0005", "0.002", "0.008"], ["0.5", "1"]),
    "fold": (["1", "5", "20"], STEPS, ["0.001", "0.01", "0.04"], ["1"]),
    "edge-on-edge": (["1", "5", "50"], STEPS, ["0.001", "0.01", "0.05"], ["1"]),
    "crossing-ropes": (["1", "5", "30"], STEPS, ["0.001", "0.01"], ["0.5", "1"]),
    "cloth-on-mesh": (["2", "10", "30"], STEPS, ["0.002", "0.01"], ["0.5"]),
    "cloth-on-plate": (["2", "10", "30"], STEPS, ["0.002", "0.01"], ["0.5", "1"]),
    "ball-on-spikes": (["1", "3", "10"], STEPS, ["0.002", "0.01"], ["0.5"]),
    "n-body": (["1", "3", "10"], STEPS, ["0.002", "0.01"], ["0.5"]),
    "eight-cloths": (["0", "5"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "twenty-cloths": (["0"], STEPS[::2], ["0.01"], ["0.5"]),
    "drop": (["0"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "free-cloths": (["2", "10", "30"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "rope-on-cloth": (["1", "5", "30"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "twist": (["1", "4"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "pressed-blocks": (["1", "4"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "cloth-funnel": (["1", "5"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "cloth-on-moving-mesh": (["1", "5"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "cloth-off-table": (["0.5", "2", "8"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
    "ball-on-net": (["2", "5", "20"], STEPS[::2], ["0.002", "0.01"], ["0.5"]),
}
# These scenes move pinned nodes or rigid bodies, which adds energy. So their energy is not judged.
DRIVEN = {"twist", "pressed-blocks", "cloth-on-moving-mesh", "cloth-off-table"}
QUICK = {
    "cloth-on-cloth": (["2", "30"], STEPS[::2], ["0.01"], ["0.5"]),
    "fold": (["5"], STEPS[::2], ["0.01"], ["1"]),
    "edge-on-edge": (["5"], STEPS[::2], ["0.01", "0.05"], ["1"]),
    "cloth-on-plate": (["10"], STEPS[::2], ["0.01"], ["0.5"]),
}
POINT = ["scene", "world", "precision", "detector", "speed", "dt", "margin", "size"]
FOUND = ["outcome", "steps", "initial_intersections", "crossings", "intersections", "wrong_side",
         "energy_gain", "response_gain", "end_speed", "impact_zone_nodes", "failsafe_holds", "ms_step"]
LIMIT = 300  # of one run, s


def points(axes, detectors):
    for scene, (speeds, steps, margins, sizes) in axes.items():
        yield from product([scene], WORLDS, PROGRAMS, detectors, speeds, steps, margins, sizes)


def measure(programs, point):
    """Runs one point and returns its row. A run that crashes or hangs also gives a row."""
    scene, world, precision, detector, speed, dt, margin, size = point
    row = dict(zip(POINT, point), outcome="ran")
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        command = [programs / PROGRAMS[precision], "simulate", scene, "--world", world,
                   *DETECTORS[detector][0], "--speed", speed, "--dt", dt, "--margin", margin,
                   "--size", size, "--threads", "1", "--stats", stats]
        try:
            code = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                  timeout=LIMIT).returncode
        except subprocess.TimeoutExpired:
            return {**row, "outcome": "hangs"}
        if code != 0:
            return {**row, "outcome": f"exit {code}"}
        run = json.loads(stats.read_text())
    if detector == "lazyccd-cuda" and not run["status"].startswith("LazyCCD: cuda,"):
        return {**row, "outcome": "not on the GPU"}
    energy = run["energy_J"]
    start = energy["start_kinetic"] + energy["start_potential"]

    def of_start(joules):
        return "0" if scene in DRIVEN else f"{joules / start:.4g}"

    row.update(
        outcome="ran" if run["finite"] else "not finite",
        steps=run["steps"], initial_intersections=run["initial_intersections"],
        crossings=sum(run["pass_throughs"].values()), intersections=run["intersections"],
        wrong_side=run["nodes_on_wrong_side"] or 0,
        energy_gain=of_start(energy["highest"] - start),
        response_gain=of_start(run["response_energy_J"]["gained"]),
        end_speed=f"{run['end_speed_m_s']['largest']:.4g}", impact_zone_nodes=run["impact_zone_nodes"],
        failsafe_holds=run["failsafe_holds"], ms_step=f"{run['ms_per_step']['total']:.4g}")
    return row


def key(row):
    return tuple(row[name] for name in POINT)


def read(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def measure_all(programs, path, todo, jobs):
    with open(path, "a", newline="") as file:
        writer = csv.DictWriter(file, POINT + FOUND)
        if file.tell() == 0:
            writer.writeheader()
        with ThreadPoolExecutor(jobs) as pool:
            running = [pool.submit(measure, programs, point) for point in todo]
            for done, future in enumerate(as_completed(running), 1):
                writer.writerow(future.result())
                file.flush()
                if sys.stderr.isatty() or done == len(todo):
                    print(f"\r{done} of {len(todo)} points", end="", file=sys.stderr)
        print(file=sys.stderr)


# Verdicts on a point, worst first: name, colour (distinguishable in grey too), meaning.
VERDICTS = [
    ("dies", "#000000", "not finite, or the run crashed or hung"),
    ("through", "#c1272d", "passes through, or intersects at the end"),
    ("energy", "#f28e2b", "energy rises by more than 5 %, or by more than 1 % by the response"),
    ("held", "#a6c8e0", "clean; the fail-safe held nodes"),
    ("clean", "#dcefe0", "clean"),
    ("unclean", "#ffffff", "intersects at the start: not counted"),
]


def counts(rows):
    found = [verdict(row) for row in rows]
    return {name: found.count(name) for name, _, _ in VERDICTS}


def print_table(rows):
    print(f"{'':<16}{'world':<12}{'precision':<11}" +
          "".join(f"{name:>9}" for name, _, _ in VERDICTS))
    for detector, world, precision in product(DETECTORS, WORLDS, PROGRAMS):
        these = [row for row in rows if (row["detector"], row["world"], row["precision"]) ==
                 (detector, world, precision)]
        if not these:
            continue
        print(f"{DETECTORS[detector][1]:<16}{world:<12}{precision:<11}" +
              "".join(f"{n:>9}" for n in counts(these).values()))


def print_differences(rows):
    """Prints the points at which the runs on GPU and CPU differ."""
    def ran(row):
        return {name: row[name] for name in FOUND if name != "ms_step"}

    def point(row):
        return tuple(row[name] for name in POINT if name != "detector")

    on_cpu = {point(row): row for row in rows if row["detector"] == "lazyccd"}
    both = [(on_cpu[point(row)], row) for row in rows
            if row["detector"] == "lazyccd-cuda" and point(row) in on_cpu]
    if both:
        differ = [row for cpu, row in both if ran(cpu) != ran(row)]
        print(f"Measured on CPU and GPU: {len(both)} points; {len(differ)} of them differ")
        for row in differ[:10]:
            print("  " + " ".join(point(row)))


def print_comparison(rows, others):
    """Prints at which points two maps differ. Timings are left out. Returns whether there are any."""
    known = {key(row): row for row in others}
    both = [(known[key(row)], row) for row in rows if key(row) in known]
    differ = [(other, row) for other, row in both
              if any(other[name] != row[name] for name in FOUND if name != "ms_step")]
    print(f"In both maps: {len(both)} points of {len(rows)} and {len(others)}; {len(differ)} differ")
    for other, row in differ[:20]:
        names = [name for name in FOUND if name != "ms_step" and other[name] != row[name]]
        print("  " + " ".join(key(row)) + ": " +
              ", ".join(f"{name} {other[name]} and {row[name]}" for name in names))
    return bool(differ)


def draw_panel(axes, rows, speeds, steps, margins, sizes):
    """Draws one cell a point, with float above the diagonal and double below it."""
    colours = {name: colour for name, colour, _ in VERDICTS}
    corners, shades = [], []
    for row in rows:
        x = speeds.index(row["speed"]) * len(margins) + margins.index(row["margin"])
        y = steps.index(row["dt"]) * len(sizes) + sizes.index(row["size"])
        far = (x, y + 1) if row["precision"] == "float" else (x + 1, y)
        corners.append([(x, y), (x + 1, y + 1), far])
        shades.append(colours[verdict(row)])
    axes.add_collection(PolyCollection(corners, facecolors=shades, edgecolors="none"))
    across, up = len(speeds) * len(margins), len(steps) * len(sizes)
    axes.set_xlim(0, across)
    axes.set_ylim(up, 0)
    for x in range(across + 1):
        axes.axvline(x, color="white" if x % len(margins) else "#555555", linewidth=0.7)
    for y in range(up + 1):
        axes.axhline(y, color="white" if y % len(sizes) else "#555555", linewidth=0.7)
    axes.set_xticks([(i + 0.5) * len(margins) for i in range(len(speeds))], speeds)
    axes.set_yticks([(i + 0.5) * len(sizes) for i in range(len(steps))],
                    [f"1/{round(1 / float(dt))}" for dt in steps])
    axes.tick_params(length=0, labelsize=7.5)


def listed(rows, name):
    return sorted({row[name] for row in rows}, key=float)


def draw(rows, out):
    scenes = list(dict.fromkeys(row["scene"] for row in rows if row["scene"] in FULL))
    scenes.sort(key=list(FULL).index)
    columns = list(product(WORLDS, DRAWN))
    plt.rcParams.update({"font.size": 9})
    axes_of_scene = {}
    for scene in scenes:
        here = [row for row in rows if row["scene"] == scene]
        axes_of_scene[scene] = (listed(here, "speed"), listed(here, "dt")[::-1],
                                listed(here, "margin"), listed(here, "size"))
    heights = [0.55 + 0.1 * len(steps) * len(sizes)
               for _, steps, _, sizes in axes_of_scene.values()]
    figure, grid = plt.subplots(len(scenes), len(columns), figsize=(12.5, sum(heights) + 1.7),
                                height_ratios=heights, squeeze=False)
    for panels, (scene, axes_of) in zip(grid, axes_of_scene.items()):
        here = [row for row in rows if row["scene"] == scene]
        for axes, (world, detector) in zip(panels, columns):
            draw_panel(axes, [row for row in here if (row["world"], row["detector"]) ==
                              (world, detector)], *axes_of)
        panels[0].set_ylabel(scene.replace("-", "-\n", 1), rotation=0, ha="right", va="center",
                             fontsize=9, labelpad=6)
    for axes, (world, detector) in zip(grid[0], columns):
        axes.set_title(f"{DETECTORS[detector][1]}\n{world} world", fontsize=10,
                       fontweight="bold" if detector == "lazyccd" else "normal")
    for axes in grid[-1]:
        axes.set_xlabel("speed, m/s; within each: thin to thick margin", fontsize=8)
    figure.legend(handles=[Patch(facecolor=colour, edgecolor="#888888", label=meaning)
                           for _, colour, meaning in VERDICTS],
                  loc="lower center", ncols=3, frameon=False, fontsize=9)
    totals = {detector: counts([row for row in rows if row["detector"] == detector])
              for detector in DRAWN}
    fails = {d: sum(t[name] for name in ("dies", "through")) for d, t in totals.items()}
    clean_starts = {d: sum(t.values()) - t["unclean"] for d, t in totals.items()}
    figure.suptitle(
        "Where collisions fail: " + ", ".join(
            f"{DETECTORS[d][1]} at {fails[d]} of {clean_starts[d]} points" for d in DRAWN) +
        "\nRows: time step in s; within each, coarse to fine triangles. "
        "Cells: float above the diagonal, double below", x=0.02, ha="left", fontsize=11)
    figure.tight_layout(rect=(0, 0.6 / figure.get_figheight(), 1, 0.99), h_pad=0.4, w_pad=0.8)
    figure.savefig(out / "map.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true", help="make a small map, in a minute")
    parser.add_argument("--jobs", type=int, default=2, help="number of points that run at the same time")
    parser.add_argument("--scenes", help="only these scenes, separated by commas")
    parser.add_argument("--detectors", default=",".join(DRAWN),
                        help="detectors, separated by commas: " + ", ".join(DETECTORS))
    parser.add_argument("--draw", action="store_true", help="measure nothing; draw the points in map.csv")
    parser.add_argument("--compare", type=Path, help="another map.csv, whose points must be equal")
    arguments = parser.parse_args()
    axes = QUICK if arguments.quick else FULL
    if arguments.scenes:
        axes = {name: axes[name] for name in arguments.scenes.split(",")}
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / "map.csv"
    if not arguments.draw:
        known = {key(row) for row in read(path)}
        wanted = points(axes, arguments.detectors.split(","))
        measure_all(arguments.programs, path, [p for p in wanted if p not in known],
                    arguments.jobs)
    rows = sorted(read(path), key=key)
    print_table(rows)
    print_differences(rows)
    differ = bool(arguments.compare) and print_comparison(rows, read(arguments.compare))
    draw(rows, arguments.out)
    print(f"Picture: {arguments.out}/map.png")
    sys.exit(differ)


if __name__ == "__main__":
    main()
