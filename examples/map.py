"""Where collision methods fail: scenes over speed, time step, thickness and triangle size.

map.py PROGRAMS OUT [--quick] [--jobs N] [--scenes A,B] [--draw]
  PROGRAMS  folder with the programs lazyccd and lazyccd_double
  OUT       folder of map.csv, which is read first, so that a stopped run goes on where it was, and
            of the pictures map.svg and map.png
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

PROGRAMS = {"float": "lazyccd", "double": "lazyccd_double"}
WORLDS = ["rigid", "deformable"]
DETECTORS = ["bullet", "lazyccd"]
STEPS = ["0.016666666666666666", "0.008333333333333333", "0.004166666666666667"]  # s

# Scene: speeds in m/s, time steps in s, margins in m, sizes (nodes along a side, times the scene's).
FULL = {
    "cloth-on-cloth": (["2", "10", "30"], STEPS, ["0.001", "0.01", "0.04"], ["0.5", "1"]),
    "small-triangles": (["0.4", "2", "10"], STEPS, ["0.0005", "0.002", "0.008"], ["0.5", "1"]),
    "fold": (["1", "5", "20"], STEPS, ["0.001", "0.01", "0.04"], ["1"]),
    "edge-on-edge": (["1", "5", "50"], STEPS, ["0.001", "0.01", "0.1"], ["1"]),
    "eight-cloths": (["0", "5"], STEPS[::2], ["0.002", "0.01"], ["0.5", "1"]),
}
QUICK = {
    "cloth-on-cloth": (["2", "30"], STEPS[::2], ["0.01"], ["0.5"]),
    "fold": (["5"], STEPS[::2], ["0.01"], ["1"]),
    "edge-on-edge": (["5"], STEPS[::2], ["0.01", "0.1"], ["1"]),
}
POINT = ["scene", "world", "precision", "detector", "speed", "dt", "margin", "size"]
FOUND = ["outcome", "steps", "piercings_at_start", "crossings", "piercings", "wrong_side",
         "energy_gain", "response_gain", "end_speed", "zone_nodes", "last_resorts", "ms_step"]
LIMIT = 120  # s a run


def points(axes):
    for scene, (speeds, steps, margins, sizes) in axes.items():
        yield from product([scene], WORLDS, PROGRAMS, DETECTORS, speeds, steps, margins, sizes)


def measure(programs, point):
    """The row of one point. A run that dies or hangs is an outcome too."""
    scene, world, precision, detector, speed, dt, margin, size = point
    row = dict(zip(POINT, point), outcome="ran")
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        command = [programs / PROGRAMS[precision], "simulate", scene, "--world", world,
                   "--detector", detector, "--speed", speed, "--dt", dt, "--margin", margin,
                   "--size", size, "--threads", "1", "--stats", stats]
        try:
            code = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                  timeout=LIMIT).returncode
        except subprocess.TimeoutExpired:
            return {**row, "outcome": "hangs"}
        if code != 0:
            return {**row, "outcome": f"exit {code}"}
        run = json.loads(stats.read_text())
    energy = run["energy_J"]
    start = energy["start_kinetic"] + energy["start_potential"]
    row.update(
        outcome="ran" if run["finite"] else "not finite",
        steps=run["steps"], piercings_at_start=run["piercings_at_start"],
        crossings=sum(run["pass_throughs"].values()), piercings=run["piercings"],
        wrong_side=run["nodes_on_wrong_side"] or 0,
        energy_gain=f"{(energy['highest'] - start) / start:.4g}" if run["finite"] else "",
        response_gain=f"{run.get('response_energy_J', {}).get('gained', 0) / start:.4g}",
        end_speed=f"{run['end_speed_m_s']['largest']:.4g}", zone_nodes=run["zone_nodes"],
        last_resorts=run["last_resorts"], ms_step=f"{run['ms_per_step']['total']:.4g}")
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


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true", help="a small map, in a minute")
    parser.add_argument("--jobs", type=int, default=2, help="points at a time")
    parser.add_argument("--scenes", help="only these, with commas between them")
    arguments = parser.parse_args()
    axes = QUICK if arguments.quick else FULL
    if arguments.scenes:
        axes = {name: axes[name] for name in arguments.scenes.split(",")}
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / "map.csv"
    known = {key(row) for row in read(path)}
    todo = [point for point in points(axes) if point not in known]
    measure_all(arguments.programs, path, todo, arguments.jobs)


if __name__ == "__main__":
    main()
