"""Points a second of a sweep with one and with several workers, in one run.

    python sweep_throughput.py [--workers 2] [--points 40] [--rounds 3]

Two kinds of points: cloth scenes with LazyCCD on one thread each, which need a core, and points that only sleep, whose
rate shows what the driver itself costs. Each figure is the best of the rounds, which alternate.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
import tempfile
import time
from types import ModuleType

from lazyccd.sweep import scenes, sweep

sleepers = ModuleType("sleepers")
sleepers.AXES = {"number": []}
sleepers.run = lambda point: time.sleep(0.2) or {}
sys.modules["sleepers"] = sleepers


def machine():
    try:
        text = subprocess.run(["lscpu"], stdout=subprocess.PIPE, universal_newlines=True).stdout
        found = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
        return f"{found['Model name'].strip()}, {found['CPU(s)'].strip()} cores"
    except (OSError, KeyError):
        return platform.processor()


def rate(task, axes, workers):
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        count = sweep(task, axes, folder, workers=workers)
        return count / (time.perf_counter() - start)


def main():
    import ray

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--points", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    ray.init(num_cpus=arguments.workers, include_dashboard=False, log_to_driver=False)
    cloths = {
        "scene": ["two_cloths"], "solver": ["lazyccd"], "speed": [2], "dt": [1 / 240], "thickness": [0.01],
        "seed": list(range(arguments.points)),
    }
    print(machine())
    for name, task, axes in (
        ("cloth scenes", scenes, cloths),
        ("sleep of 0.2 s", sleepers, {"number": list(range(arguments.points))}),
    ):
        first = {axis: values[: 2 * arguments.workers] for axis, values in axes.items()}
        rate(task, first, arguments.workers)  # starts the workers
        rates = {1: 0.0, arguments.workers: 0.0}
        for _ in range(arguments.rounds):
            for workers in rates:
                rates[workers] = max(rates[workers], rate(task, axes, workers))
        one, several = rates.values()
        print(f"{name}: {one:.3g} points a second with 1 worker, {several:.3g} with {arguments.workers}: {several / one:.2f} times")
    ray.shutdown()


if __name__ == "__main__":
    main()
