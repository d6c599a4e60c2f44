"""Compares LazyCCD with Bullet alone in scenes in which Bullet alone misses nothing. There LazyCCD should
give the same motion and cost no more.

no_regression.py PROGRAMS [--rounds N] [--csv FILE] [--times-csv FILE]
  PROGRAMS  folder with the programs lazyccd and lazyccd_double

The first table compares motions: the distance between the same nodes of two runs, mean / largest, in
margins. To judge these numbers, compare them with the distance between runs of Bullet alone that differ
only a little: thrown 0.1 % faster, in the other precision, at half the time step. "Bullet mended" is
Bullet alone, but it keeps the momentum that its own contacts lose (scenes/worlds/mended_bullet.h).
--csv writes this table with more times; --times-csv writes the second one.

The second table compares times of a whole step, as medians over the rounds (--rounds 0: no times). If
Bullet alone fails at 1/60 s, it also gives the ratio of times per simulated second: LazyCCD at 1/60 s to
Bullet alone at 1/240 s. Run it on an idle machine.
"""
import argparse
import csv
import json
import subprocess
import tempfile
from pathlib import Path
from statistics import median

import numpy

from machine import machine

PROGRAMS = {"float": "lazyccd", "double": "lazyccd_double"}
# Scene, world, speed, size. At 1/240 s Bullet alone misses nothing in them.
SCENES = [
    ("cloth-on-cloth", "rigid", "2", "0.5"),
    ("cloth-on-cloth", "deformable", "2", "0.5"),
    ("fold", "deformable", "1", "1"),
    ("cloth-off-table", "deformable", "0.5", "0.5"),
    ("cloth-on-mesh", "deformable", "2", "0.5"),
    ("cloth-on-plate", "deformable", "2", "0.5"),
]
COARSE, FINE = 1 / 60, 1 / 240  # s
EVERY = 6  # steps of FINE between two frames
MOMENTS = [24, 30, 48, 96]  # steps in the CSV, besides the last; the first contact is at 13 to 23
SHOWN = 30  # step in the printed table, besides the last
# The compared pairs of runs.
COMPARED = {
    "Bullet faster": ("faster", "bullet"),
    "Bullet other precision": ("other", "bullet"),
    "Bullet half step": ("half", "bullet"),
    "LazyCCD faster": ("lazyccd faster", "lazyccd"),
    "Bullet mended": ("mended", "bullet"),
    "LazyCCD": ("lazyccd", "bullet"),
    "LazyCCD, Bullet mended": ("lazyccd", "mended"),
}


def read_vertices(path):
    """Reads the vertices of a binary little-endian PLY, as `lazyccd simulate` writes it."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    scalar = "<f8" if any(line.startswith("property double") for line in lines) else "<f4"
    return numpy.frombuffer(body, scalar, 3 * count).reshape(-1, 3).astype(float)


def run(program, scene, detector, dt, faster=1):
    """Runs a scene. Returns its counters and its frames, one every EVERY steps of FINE."""
    name, world, speed, size = scene
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        subprocess.run([program, "simulate", name, "--world", world, "--speed", repr(float(speed) * faster),
                        "--size", size, "--detector", detector, "--dt", repr(dt), "--stats", stats,
                        "--out", folder, "--every", str(round(EVERY * FINE / dt))],
                       check=True, stdout=subprocess.DEVNULL)
        frames = [read_vertices(path) for path in sorted(Path(folder).glob("*.ply"))]
        return json.loads(stats.read_text()), numpy.array(frames)


def paths(programs, precision, scene):
    """Returns Bullet's and LazyCCD's counters, and mean and largest distance by frame for each comparison."""
    program = programs / PROGRAMS[precision]
    other = programs / next(name for key, name in PROGRAMS.items() if key != precision)
    runs = {
        "bullet": run(program, scene, "bullet", FINE),
        "faster": run(program, scene, "bullet", FINE, 1.001),
        "other": run(other, scene, "bullet", FINE),
        "half": run(program, scene, "bullet", FINE / 2),
        "mended": run(program, scene, "mended-bullet", FINE),
        "lazyccd": run(program, scene, "lazyccd", FINE),
        "lazyccd faster": run(program, scene, "lazyccd", FINE, 1.001),
    }
    alone, frames = runs["bullet"]
    moving = numpy.ptp(frames, axis=0).max(axis=1) > 0
    apart = {}
    for name, (a, b) in COMPARED.items():
        distance = runs[a][1][:len(frames), moving] - runs[b][1][:len(frames), moving]
        margins = numpy.linalg.norm(distance, axis=2) / alone["margin_m"]
        apart[name] = list(zip(margins.mean(axis=1), margins.max(axis=1)))
    return alone, runs["lazyccd"][0], apart


def wrong(stats):
    return sum(stats["pass_throughs"].values()) + stats["intersections"] + (stats["nodes_on_wrong_side"] or 0)


def compare_paths(programs, file):
    writer = csv.writer(file) if file else None
    if writer:
        sides = [f"{name}: {which}" for name in COMPARED for which in ("mean", "largest")]
        writer.writerow(["scene", "world", "precision", "m/s", "step", *sides, "machine"])
    row = "{:<15} {:<11} {:<7} {:>5} {:>5} " + " {:>12}" * len(COMPARED)
    print("Distance between the same nodes, mean / largest, in margins")
    print(row.format("", "", "", "", "", "Bullet", "Bullet,", "Bullet,", "LazyCCD", "Bullet", "", "LazyCCD,"))
    print(row.format("", "", "", "", "", "0.1 % faster", "other", "half the", "0.1 % faster", "mended,",
                     "LazyCCD,", "Bullet"))
    print(row.format("scene", "world", "", "m/s", "step", "from itself", "precision", "step", "from itself",
                     "Bullet", "Bullet", "mended"))
    for precision in PROGRAMS:
        for scene in SCENES:
            alone, ours, apart = paths(programs, precision, scene)
            end = EVERY * (len(apart["LazyCCD"]) - 1)
            name, world, speed, _ = scene
            for step in sorted({*MOMENTS, end}):
                values = [apart[key][step // EVERY] for key in COMPARED]
                if writer:
                    numbers = [f"{value:.4g}" for pair in values for value in pair]
                    writer.writerow([name, world, precision, speed, step, *numbers, machine()])
                if step in (SHOWN, end):
                    print(row.format(name, world, precision, speed, step,
                                     *(f"{mean:.2f} / {largest:.2f}" for mean, largest in values)))
            if wrong(alone) or wrong(ours):
                print(f"  wrong: Bullet {wrong(alone)}, LazyCCD {wrong(ours)}")


def compare_times(programs, rounds, file):
    writer = csv.writer(file, lineterminator="\n") if file else None
    if writer:
        writer.writerow(["scene", "world", "precision", "m/s", "Bullet ms", "LazyCCD ms", "1/60 s over 1/240 s"])
    row = "{:<15} {:<11} {:<7} {:>5} {:>10} {:>11} {:>6} {:>12}"
    print(row.format("", "", "", "", "Bullet", "LazyCCD", "", "1/60 against"))
    print(row.format("scene", "world", "", "m/s", "ms a step", "ms a step", "ratio", "1/240, a s"))
    for precision, program in PROGRAMS.items():
        for scene in SCENES:
            times = {"bullet": [], "lazyccd": [], "coarse": []}

            def add(key, detector, dt):
                stats, _ = run(programs / program, scene, detector, dt)
                times[key].append(stats["ms_per_step"]["total"])

            for _ in range(rounds):
                add("bullet", "bullet", FINE)
                add("lazyccd", "lazyccd", FINE)
                add("coarse", "lazyccd", COARSE)
            alone_coarse, _ = run(programs / program, scene, "bullet", COARSE)
            ms = {key: median(values) for key, values in times.items()}
            seconds = ms["coarse"] / COARSE / (ms["bullet"] / FINE)
            name, world, speed, _ = scene
            compared = f"{seconds:.2f}" if wrong(alone_coarse) else ""
            cells = [name, world, precision, speed, f"{ms['bullet']:.3f}", f"{ms['lazyccd']:.3f}"]
            print(row.format(*cells, f"{ms['lazyccd'] / ms['bullet']:.2f}", compared))
            if writer:
                writer.writerow([*cells, compared])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--csv", type=argparse.FileType("w"))
    parser.add_argument("--times-csv", type=argparse.FileType("w"))
    arguments = parser.parse_args()
    compare_paths(arguments.programs, arguments.csv)
    if arguments.rounds > 0:
        print()
        compare_times(arguments.programs, arguments.rounds, arguments.times_csv)


if __name__ == "__main__":
    main()
