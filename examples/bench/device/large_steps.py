"""Times steps of large scenes with the detection on the GPU and on the CPU, in turn with an earlier program.

large_steps.py PROGRAM BEFORE CSV
  PROGRAM, BEFORE   the program lazyccd, now and at an earlier commit

Medians over the steps that run a detection, then over ten runs with a GPU, three without, in milliseconds.
"""
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

SCENES = [("cloth-on-cloth", "rigid", 4), ("drop", "rigid", 4), ("n-body", "deformable", 2)]
BACKENDS = {"cuda": "GPU", "cpu": "CPU, all threads"}
PARTS = {"": "ms_total", "detection ": "ms_detect", "response ": "ms_response"}
RUNS, STEPS = {"cuda": 10, "cpu": 3}, 60


def run(program, scene, backend):
    """Returns the medians of one run, by part."""
    name, world, size = scene
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        subprocess.run([program, "simulate", name, "--world", world, "--size", str(size), "--steps", str(STEPS),
                        "--backend", backend, "--stats", str(stats)], check=True, stdout=subprocess.DEVNULL)
        each = json.loads(stats.read_text())["each_step"]
    steps = [i for i in range(STEPS) if each["detections"][i]]
    return {part: median(each[name][i] for i in steps) for part, name in PARTS.items()}


def main():
    now, before, path = sys.argv[1:]
    rows = []
    for scene in SCENES:
        for backend, called in BACKENDS.items():
            runs = [(run(before, scene, backend), run(now, scene, backend)) for _ in range(RUNS[backend])]
            row = {"scene": ":".join(map(str, scene)), "backend": called}
            for part in PARTS:
                for i, when in enumerate(("before ", "")):
                    row[f"{when}{part}ms"] = round(median(times[i][part] for times in runs), 3)
            rows.append(row)
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
