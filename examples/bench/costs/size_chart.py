"""Times a step over the number of triangles: Bullet alone, and LazyCCD with one thread, with all, on a GPU.

size_chart.py PROGRAM [--gpu] [--sizes 0.05,0.1,...] [--limit SECONDS] [--csv FILE] [--chart FILE] [SCENE:WORLD...]
size_chart.py --read CSV --chart FILE     draws the chart of an earlier run
  PROGRAM   the program lazyccd; --gpu: it has the GPU backend, and the machine a GPU
  --sizes   factors of the number of nodes along each side of a cloth
  --limit   a method is not run on larger scenes once a run has taken this long; default 60

Each run is one second from the start of the scene, in steps of 1/60 s. The median step counts.
"""
import argparse
import csv
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

SCENES = ["drop:rigid", "drop:deformable", "cloth-on-cloth:rigid"]
METHODS = {
    "Bullet alone": ["--detector", "bullet"],
    "LazyCCD, one thread": ["--backend", "cpu", "--threads", "1"],
    "LazyCCD, all threads": ["--backend", "cpu", "--threads", "0"],
    "LazyCCD, GPU": ["--backend", "cuda"],  # only with --gpu
}
STEPS = 60


def simulate(program, scene, size, options):
    name, world = scene.split(":")
    command = [program, "simulate", name, "--world", world, "--size", str(size), "--dt", str(1 / 60), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def count_triangles(program, scene, size):
    """Triangles of all bodies of the scene."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(program, scene, size, ["--steps", "0", "--out", folder])
        header = (Path(folder) / "00000.ply").read_bytes().split(b"end_header")[0]
    return next(int(line.split()[2]) for line in header.split(b"\n") if line.startswith(b"element face"))


def measure(program, methods, scenes, sizes, limit):
    """Yields the rows one by one, so that a run that is stopped keeps what it has."""
    for scene in scenes:
        slow = set()
        for size in sizes:
            triangles = count_triangles(program, scene, size)
            for method, options in methods.items():
                if method in slow:
                    continue
                with tempfile.TemporaryDirectory() as folder:
                    stats = Path(folder) / "stats.json"
                    start = time.monotonic()
                    simulate(program, scene, size, ["--steps", str(STEPS), "--stats", str(stats), *options])
                    if time.monotonic() - start > limit:
                        slow.add(method)
                    result = json.loads(stats.read_text())
                passed = result["pass_throughs"]
                yield {"scene": scene, "size": size, "triangles": triangles, "method": method,
                       "ms": result["median_ms_per_step"]["total"],
                       "passed": passed["vertex_face"] + passed["edge_edge"]}


def record(rows, path):
    """Prints the rows, writes them to the file at `path` unless that is None, and returns them."""
    done = []
    with open(path or os.devnull, "w", newline="") as file:
        writer = csv.DictWriter(file, ["scene", "size", "triangles", "method", "ms", "passed"])
        writer.writeheader()
        for row in rows:
            print("{scene:22} {triangles:8} {method:22} {ms:10.3f} ms {passed:8} passed".format(**row), flush=True)
            writer.writerow(row)
            file.flush()
            done.append(row)
    return done


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, axes = pyplot.subplots(1, len(scenes), figsize=(4.2 * len(scenes), 4), sharey=True, squeeze=False)
    for axis, scene in zip(axes[0], scenes):
        for method, colour in zip(METHODS, ["tab:red", "tab:blue", "tab:cyan", "tab:green"]):
            points = [row for row in rows if row["scene"] == scene and row["method"] == method]
            if not points:
                continue
            axis.plot([row["triangles"] for row in points], [row["ms"] for row in points], marker="o", color=colour,
                      label=method)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(scene.replace(":", ", "))
        axis.set_xlabel("triangles")
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("milliseconds a step")
    axes[0][0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?")
    parser.add_argument("--read")
    parser.add_argument("--gpu", action="store_true")
    parser.add_argument("--sizes", default="0.05,0.1,0.2,0.4,0.8,1.5,3,6,12")
    parser.add_argument("--limit", type=float, default=60)
    parser.add_argument("--csv")
    parser.add_argument("--chart")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    arguments = parser.parse_intermixed_args()
    if arguments.read:
        with open(arguments.read, newline="") as file:
            rows = [{**row, "triangles": int(row["triangles"]), "ms": float(row["ms"])} for row in csv.DictReader(file)]
    elif arguments.program:
        sizes = [float(size) for size in arguments.sizes.split(",")]
        methods = {name: options for name, options in METHODS.items() if arguments.gpu or "cuda" not in options}
        found = measure(arguments.program, methods, arguments.scenes or SCENES, sizes, arguments.limit)
        rows = record(found, arguments.csv)
    else:
        parser.error("PROGRAM or --read is missing")
    if arguments.chart:
        draw(rows, arguments.chart)


if __name__ == "__main__":
    main()
