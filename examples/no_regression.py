"""Where Bullet alone is right: does LazyCCD end where Bullet does, at no more than Bullet's cost?

no_regression.py PROGRAMS [--rounds N]
  PROGRAMS  folder with the programs lazyccd and lazyccd_double
For each scene the distance between the end states of both (the largest of any node), in margins, and
the time of a whole step (median of the rounds). Where Bullet alone is wrong at 1/60 s, also the time a
simulated second with LazyCCD at 1/60 s against Bullet alone at 1/240 s. Wants an idle machine.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path
from statistics import median

import numpy

PROGRAMS = {"float": "lazyccd", "double": "lazyccd_double"}
# Scene, world, speed, size: Bullet alone is right at 1/240 s.
SCENES = [
    ("cloth-on-cloth", "rigid", "2", "0.5"),
    ("cloth-on-cloth", "deformable", "2", "0.5"),
    ("fold", "deformable", "1", "1"),
    ("cloth-off-table", "deformable", "0.5", "0.5"),
    ("cloth-on-mesh", "deformable", "2", "0.5"),
]
COARSE, FINE = 1 / 60, 1 / 240  # s


def read_vertices(path):
    """Of a binary little-endian PLY as `lazyccd simulate` writes it."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    scalar = "<f8" if any(line.startswith("property double") for line in lines) else "<f4"
    return numpy.frombuffer(body, scalar, 3 * count).reshape(-1, 3).astype(float)


def run(program, scene, world, speed, size, detector, dt):
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        subprocess.run([program, "simulate", scene, "--world", world, "--speed", speed, "--size", size,
                        "--detector", detector, "--dt", repr(dt), "--stats", stats, "--out", folder,
                        "--every", "1000000"], check=True, stdout=subprocess.DEVNULL)
        return json.loads(stats.read_text()), read_vertices(max(Path(folder).glob("*.ply")))


def wrong(stats):
    return sum(stats["pass_throughs"].values()) + stats["piercings"] + (stats["nodes_on_wrong_side"] or 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    row = "{:<16} {:<11} {:<7} {:>5} {:>7} {:>7} {:>9} {:>10} {:>11} {:>6} {:>12}"
    print(row.format("scene", "world", "", "m/s", "Bullet", "LazyCCD", "apart,", "Bullet", "LazyCCD",
                     "ratio", "1/60 against"))
    print(row.format("", "", "", "", "wrong", "wrong", "margins", "ms a step", "ms a step", "",
                     "1/240, a s"))
    for precision, name in PROGRAMS.items():
        for scene, world, speed, size in SCENES:
            times = {"bullet": [], "lazyccd": [], "coarse": []}
            for _ in range(arguments.rounds):
                ends = {}
                for detector in ("bullet", "lazyccd"):
                    ends[detector] = run(arguments.programs / name, scene, world, speed, size,
                                         detector, FINE)
                    times[detector].append(ends[detector][0]["ms_per_step"]["total"])
                coarse, _ = run(arguments.programs / name, scene, world, speed, size, "lazyccd", COARSE)
                times["coarse"].append(coarse["ms_per_step"]["total"])
            alone_coarse, _ = run(arguments.programs / name, scene, world, speed, size, "bullet", COARSE)
            (alone, x), (ours, y) = ends["bullet"], ends["lazyccd"]
            apart = numpy.linalg.norm(x - y, axis=1).max() / ours["margin_m"]
            ms = {key: median(values) for key, values in times.items()}
            seconds = ms["coarse"] / COARSE / (ms["bullet"] / FINE)
            print(row.format(scene, world, precision, speed, wrong(alone), wrong(ours),
                             f"{apart:.2f}", f"{ms['bullet']:.3f}", f"{ms['lazyccd']:.3f}",
                             f"{ms['lazyccd'] / ms['bullet']:.2f}",
                             f"{seconds:.2f}" if wrong(alone_coarse) else "-"))


if __name__ == "__main__":
    main()
