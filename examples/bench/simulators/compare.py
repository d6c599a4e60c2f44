"""Steps the same scenes of cloth in several simulators on one thread, and counts what goes wrong in each.

compare.py [--only NAME,...] [--scenes NAME,...] [--csv FILE] [--limit SECONDS]
  --only    simulators, by their names or the beginnings of these; default: all
  --limit   seconds of stepping after which a run ends; default: 120

Needs the Python package of LazyCCD and what requirements.txt names. Each run is a process of its own.
Times are those of a frame of 1/60 s: the simulator's own steps alone, without the judge and without the
construction. Kernels that a simulator compiles at their first use are compiled before. Run it on an idle
machine.

What the columns say:
  ms             of a frame: median; then mean and longest
  inside, end    nodes deeper than 1 mm in the ball or the table: most at the end of a step, and at the end
  passed         pairs of cloth that met although their surfaces must not: vertex and face, or two edges
  cut            edges that stick in faces at the end
  stretch, end   longest edge over its rest length: largest, and at the end
  height         mean height of all nodes at the end, m: whether the cloth still lies where it should
  fastest        speed of the fastest node in the last frame, m/s
"""
import argparse
import csv
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from statistics import mean, median

from scenes import FRAME, SCENES, Unsupported

MODULES = {  # module of this folder: the package that it needs
    "bullet": "pybullet",
    "mujoco_flex": "mujoco",
    "newton_vbd": "newton",
    "pypbd_cloth": "pypbd",
}
NAMES = {  # names of each module's variants, so that no simulator is loaded to list them
    "bullet": ["bullet-rigid-60", "bullet-rigid-240", "bullet-deformable-240",
               "lazyccd-rigid-60", "lazyccd-rigid-240", "lazyccd-deformable-240"],
    "mujoco_flex": ["mujoco-rows", "mujoco-passive", "mujoco-ipc", "mujoco-ipc-240"],
    "newton_vbd": ["newton-vbd", "newton-vbd-dat"],
    "pypbd_cloth": ["pypbd-240", "pypbd-1200"],
}
COLUMNS = ["scene", "simulator", "outcome", "ms_median", "ms_mean", "ms_worst", "frames", "inside_worst",
           "inside_end", "deepest_mm", "pass_throughs", "intersections_end", "stretch_worst", "stretch_end",
           "height_end_m", "fastest_end_m_s", "finite", "settings"]
SHOWN = {"ms_median": "ms", "ms_mean": "mean", "ms_worst": "worst", "inside_worst": "inside",
         "inside_end": "end", "pass_throughs": "passed", "intersections_end": "cut",
         "stretch_worst": "stretch", "stretch_end": "end", "height_end_m": "height",
         "fastest_end_m_s": "fastest", "finite": "finite"}
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def construct(simulator, scene):
    module = importlib.import_module(next(name for name, names in NAMES.items() if simulator in names))
    return module.Simulator(scene, **module.VARIANTS[simulator])


def run(simulator, scene_name, limit):
    """Runs one scene in this process and returns its row."""
    from counter import Counter

    scene = SCENES[scene_name]
    row = {"scene": scene_name, "simulator": simulator, "outcome": "ran"}
    try:
        world = construct(simulator, scene)
    except Unsupported as reason:
        return dict(row, outcome=f"cannot: {reason}")
    if world.compiles:
        for _ in range(2 * world.substeps):
            world.step()
        world.close()
        world = construct(simulator, scene)
    row["settings"] = world.name
    counter = Counter(scene)
    before = world.positions()
    times = []
    while len(times) < scene.frames:
        milliseconds = 0.0
        for _ in range(world.substeps):
            start = time.perf_counter()
            world.step()
            milliseconds += 1e3 * (time.perf_counter() - start)
            after = world.positions()
            if not counter.step(before, after):
                row["outcome"] = f"explodes at {len(times) * FRAME:.2f} s"
                break
            before = after
        times.append(milliseconds)
        if not counter.finite:
            break
        counter.frame(after)
        if sum(times) > 1e3 * limit and len(times) < scene.frames:
            row["outcome"] = f"stopped at {len(times) * FRAME:.2f} s"
            break
    world.close()
    row.update(frames=len(times), ms_median=median(times), ms_mean=mean(times), ms_worst=max(times))
    return {**row, **counter.result()}


def run_apart(simulator, scene_name, limit):
    """The same in a process of its own, so that a crash ends one run alone. Its log files are thrown away."""
    program = str(Path(__file__).resolve())
    command = [sys.executable, program, "--one", simulator, scene_name, "--limit", str(limit)]
    environment = {**os.environ, **ONE_THREAD}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode == 0 and lines:
        return json.loads(lines[-1])
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return {"scene": scene_name, "simulator": simulator, "outcome": f"failed ({done.returncode}): {last}"}


def cell(value):
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return f"{value:.3g}" if isinstance(value, float) and abs(value) < 1000 else f"{value:.0f}"


def print_row(row):
    note = "" if row["outcome"] == "ran" else row["outcome"]
    print(f"| {row['scene']} | {row['simulator']} | "
          + " | ".join(cell(row[name]) if name in row else "" for name in SHOWN) + f" | {note} |", flush=True)


def chosen(text, names):
    """The names that a list of names, or of their beginnings, asks for."""
    wanted = text.split(",")
    unknown = [part for part in wanted if not any(name.startswith(part) for name in names)]
    if unknown:
        raise SystemExit(f"there is no {', '.join(unknown)}; there are {', '.join(names)}")
    return [name for name in names if any(name.startswith(part) for part in wanted)]


def main():
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    names = [name for module in NAMES.values() for name in module]
    parser.add_argument("--only", default=",".join(names))
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--csv")
    parser.add_argument("--limit", type=float, default=120)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(run(*arguments.one, arguments.limit)))
        return
    missing = [name for name, package in MODULES.items() if find_spec(package) is None]
    for module in missing:
        print(f"{MODULES[module]} is not installed: {', '.join(NAMES[module])} are left out", file=sys.stderr)
    present = [name for module in NAMES if module not in missing for name in NAMES[module]]
    rows = []
    print("| scene | simulator | " + " | ".join(SHOWN.values()) + " | |")
    print("|---" * (len(SHOWN) + 3) + "|")
    for scene in chosen(arguments.scenes, list(SCENES)):
        for simulator in chosen(arguments.only, names):
            if simulator in present:
                rows.append(run_apart(simulator, scene, arguments.limit))
                print_row(rows[-1])
    print("\n" + "\n".join(f"- {name}: {settings}" for name, settings in
                           {row["simulator"]: row["settings"] for row in rows if "settings" in row}.items()))
    if arguments.csv:
        Path(arguments.csv).parent.mkdir(parents=True, exist_ok=True)
        with open(arguments.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
