"""python -m lazyccd.sweep FOLDER: measures a scene over speed, time step, thickness and seed.

Rows go to Parquet files in FOLDER, the map to FOLDER/map.png. The same command again continues a sweep that was
stopped. Without --task the scenes of lazyccd/sweep/scenes.py run in PyBullet.

    python -m lazyccd.sweep out --axis speed=1,10,30 --axis seed=0,1,2 --workers 2
    python -m lazyccd.sweep out --task examples/bench/map_sweep.py --set programs=build/cpu/examples
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import sys
import time
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, List

from . import chart, driver, store


def value_of(text: str) -> Any:
    """A whole number, a number, a fraction such as 1/240, or the text itself."""
    for kind in (int, float, lambda word: float(Fraction(word))):
        try:
            return kind(text)
        except (ValueError, ZeroDivisionError):
            continue
    return text


def task_of(name: str) -> ModuleType:
    if not name.endswith(".py"):
        return importlib.import_module(name)
    path = Path(name).resolve()
    sys.path.insert(0, str(path.parent))
    return importlib.import_module(path.stem)


def _pairs(texts: List[str], parser: argparse.ArgumentParser) -> Dict[str, str]:
    pairs = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            parser.error(f"{text}: NAME=VALUE is needed")
        pairs[name] = value
    return pairs


class Progress:
    """A line that tells rows, rate and the time that is left."""

    def __init__(self) -> None:
        self.start, self.first = time.monotonic(), -1

    def __call__(self, rows: int, of: int) -> None:
        if self.first < 0:
            self.first = rows
        took, new = time.monotonic() - self.start, rows - self.first
        line = f"{rows} of {of} points"
        if new:
            line += f", {new / took:.3g} a second, {(of - rows) * took / new:.0f} s left"
        if sys.stderr.isatty():
            print(f"\r{line:<70}", end="" if rows < of else "\n", file=sys.stderr, flush=True)
        elif rows == of or new % 50 == 0:
            print(line, file=sys.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m lazyccd.sweep", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", help="folder of the rows and the map")
    parser.add_argument("--task", default="lazyccd.sweep.scenes", help="module, or file, that measures")
    parser.add_argument("--axis", action="append", default=[], metavar="NAME=A,B", help="values of an axis; 1/240 works")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the task")
    parser.add_argument("--workers", type=int, help="points at the same time; all CPUs by default")
    parser.add_argument("--address", help="a Ray cluster; this machine by default")
    parser.add_argument("--attempts", type=int, default=driver.ATTEMPTS, help="runs of a point whose worker dies")
    parser.add_argument("--draw", action="store_true", help="measure nothing; draw the rows")
    parser.add_argument("--no-map", action="store_true", help="draw nothing")
    arguments = parser.parse_args()
    try:
        task = task_of(arguments.task)
        axes = {n: [value_of(v) for v in text.split(",")] for n, text in _pairs(arguments.axis, parser).items()}
        settings = {n: value_of(v) for n, v in _pairs(arguments.set, parser).items()}
        driver.points_of(task, axes, settings)
    except (ImportError, ValueError, TypeError) as failure:
        parser.error(str(failure))
    if not arguments.draw:
        start = time.monotonic()
        measured = driver.sweep(
            task, axes, arguments.folder, workers=arguments.workers, address=arguments.address, settings=settings,
            attempts=arguments.attempts, progress=Progress(),
        )
        print(f"{measured} points in {time.monotonic() - start:.1f} s")
    if not arguments.no_map:
        table = store.read(arguments.folder)
        print(getattr(task, "draw", chart.draw)(table, arguments.folder))


if __name__ == "__main__":
    main()
