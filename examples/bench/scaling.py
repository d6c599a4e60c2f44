"""Times a step over the number of threads, part by part, and checks that the motion stays the same.

scaling.py PROGRAM [--before PROGRAM] [--before-threads 1,16] [--threads 1,2,4] [--steps N]
           [--without-bullet] [--csv FILE] [--chart FILE] [SCENE...]
scaling.py --read CSV --chart FILE     draws the chart of an earlier run
  --threads "auto" among the numbers: chosen by the program; -1 in the CSV file
  PROGRAM   the program lazyccd; --before: an earlier one, timed in turn with it
  SCENE     scene:world:size; default: four scenes

"same" says that contacts and the final energy are the same as with one thread. Run it on an idle machine
that has as many cores as threads.
"""
import argparse
import csv
import json
import subprocess
import tempfile
from pathlib import Path

SCENES = ["cloth-on-cloth:rigid:4", "drop:rigid:4", "n-body:deformable:2", "twenty-cloths:deformable:2"]
AUTOMATIC = -1  # the program chooses the number of threads
PARTS = ["total", "bullet", "gather", "detect", "response", "write"]


def run(program, scene, threads, steps):
    """Steps the scene and returns its statistics. threads 0: Bullet alone; AUTOMATIC."""
    name, world, size = scene.split(":")
    detector = ["--detector", "bullet"] if threads == 0 else ["--backend", "cpu", "--threads",
                                                                   str(max(threads, 0))]
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        subprocess.run(
            [program, "simulate", name, "--world", world, "--size", size, "--steps", str(steps),
             "--stats", str(stats)] + detector,
            check=True, stdout=subprocess.DEVNULL)
        return json.loads(stats.read_text())


def outcome(stats):
    return stats["contacts"], stats["pass_throughs"], stats["energy_J"], stats["angular_momentum_kg_m2_s"]


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4.5))
    for scene in dict.fromkeys(row["scene"] for row in rows):
        points = [row for row in rows if row["scene"] == scene and row["program"] == "now" and row["threads"] > 0]
        one = next(row["total"] for row in points if row["threads"] == 1)
        axes.plot([row["threads"] for row in points], [one / row["total"] for row in points], marker="o",
                  label=scene.replace(":", ", "))
    most = max(row["threads"] for row in rows)
    axes.plot([1, most], [1, most], color="grey", linestyle="--", label="ideal")
    axes.set_xscale("log", base=2)
    axes.set_yscale("log", base=2)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.set_xlabel("threads")
    axes.set_ylabel("speed-up of a whole step")
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?")
    parser.add_argument("--read")
    parser.add_argument("--before")
    parser.add_argument("--before-threads")
    parser.add_argument("--without-bullet", action="store_true")
    parser.add_argument("--threads", default="1,2,4,8,16")
    parser.add_argument("--steps", type=int, default=150)
    parser.add_argument("--csv")
    parser.add_argument("--chart")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    arguments = parser.parse_intermixed_args()
    if arguments.read:
        with open(arguments.read, newline="") as file:
            rows = [{**row, "threads": int(row["threads"]), "total": float(row["total"])}
                    for row in csv.DictReader(file)]
        return draw(rows, arguments.chart)
    if not arguments.program:
        parser.error("PROGRAM or --read is missing")
    def counts_of(text):
        return [AUTOMATIC if count == "auto" else int(count) for count in text.split(",")]

    counts = counts_of(arguments.threads)
    counts_before = counts_of(arguments.before_threads or arguments.threads)
    rows = []
    print("| scene | program | threads | " + " | ".join(PARTS) + " | same |")
    print("|---" * (len(PARTS) + 4) + "|")
    for scene in arguments.scenes or SCENES:
        runs = [] if arguments.without_bullet else [("Bullet alone", arguments.program, 0)]
        for count in counts:
            runs.append(("now", arguments.program, count))
            if arguments.before and count in counts_before:
                runs.append(("before", arguments.before, count))
        first = {}
        for label, program, count in runs:
            stats = run(program, scene, count, arguments.steps)
            same = outcome(stats) == first.setdefault(label, outcome(stats))
            row = {"scene": scene, "program": label, "threads": count, "same": same, **stats["ms_per_step"]}
            rows.append(row)
            print(f"| {scene} | {label} | {'auto' if count == AUTOMATIC else count or ''} | "
                  + " | ".join(f"{row[part]:.2f}" for part in PARTS) + f" | {'yes' if same else 'NO'} |", flush=True)
    if arguments.csv:
        with open(arguments.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, ["scene", "program", "threads", *PARTS, "same"], extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)
    if arguments.chart:
        draw(rows, arguments.chart)


if __name__ == "__main__":
    main()
