"""What each number of plugin/settings.h is for: halves and doubles it, and says which scene fails then.

  python3 tests/long/vary_numbers.py build                         # into build/numbers, after each change of the code
  python3 tests/long/vary_numbers.py run FOLDER CSV NAME...        # FOLDER: build/numbers/bin

The build is the ordinary one, but for settings.h: its numbers are read from the environment when a program starts.
Scenes: quick tests of the adapter, behaviour scenes, links at 1/60 s (lazyccd_stretch), all in single precision.
"""
import argparse
import concurrent.futures
import contextlib
import csv
import math
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/numbers"
PROGRAMS = ["tests/lazyccd_tests_bullet", "tests/lazyccd_stretch", "examples/bench/lazyccd_behaviour"]
# They take long, and compare LazyCCD with itself.
LEFT_OUT = ["random starts at a distance*", "the motion of every scene*", "cloth that is pressed for many steps*"]
# Constants at compile time: sizes of arrays, shapes.
FIXED = ["solver.max_open_batches", "solver.max_layers", "solver.morton_bits_per_axis", "solver.split_gap_fraction",
         "shapes.cylinder_end", "shapes.cylinder_side", "shapes.exit_tolerance", "shapes.max_convex_sides",
         "shapes.max_convex_vertices", "shapes.plane_square_ratio"]
DECLARATION = re.compile(r"inline constexpr (double|float|int|std::\w+_t) ([^;{}]+);")


# Put before the numbers. The environment has a factor for each that is to change.
TIMES = """#include <cstdlib>

namespace lazyccd::bullet::settings {

template <class T>
T times(const char* name, T value) {
  const char* const factor = std::getenv(name);
  return factor ? static_cast<T>(std::atof(factor) * static_cast<double>(value)) : value;
}

}  // namespace lazyccd::bullet::settings

"""


def names_and_values(declaration):
    """Of a declaration of one or several numbers."""
    return [[text.strip() for text in part.split(" = ", 1)] for part in declaration[2].split(", ")]


def for_each_namespace(settings, change):
    """settings.h with the inside of each namespace as change(name, text) returns it."""
    return re.sub(r"(?<=namespace )(\w+) \{(.*?)(?=\}  // namespace \1)",
                  lambda found: f"{found[1]} {{{change(found[1], found[2])}", settings, flags=re.S)


def numbers_of(settings, names):
    """Name and value of each number that may change, as they stand in settings.h."""
    numbers = []

    def collect(namespace, text):
        numbers.extend((f"{namespace}.{name}", value) for declaration in DECLARATION.finditer(text)
                       for name, value in names_and_values(declaration)
                       if not names or namespace in names or f"{namespace}.{name}" in names)
        return text

    for_each_namespace(settings, collect)
    return [number for number in numbers if number[0] not in FIXED]


def from_environment(settings):
    """settings.h with numbers that the environment may multiply."""
    def read(namespace, declaration):
        kind = declaration[1]
        return "\n".join(
            f"inline constexpr {kind} {name} = {value};" if f"{namespace}.{name}" in FIXED else
            f'inline const {kind} {name} = times<{kind}>("{namespace}.{name}", {value});'
            for name, value in names_and_values(declaration))

    changed = for_each_namespace(settings, lambda namespace, text: DECLARATION.sub(
        lambda declaration: read(namespace, declaration), text))
    return changed.replace("namespace lazyccd::bullet::settings {", TIMES + "namespace lazyccd::bullet::settings {", 1)


def build():
    source = BUILD / "source"
    files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=True).stdout
    for name in filter(None, files.split("\0")):
        original = (ROOT / name).read_bytes()
        if name == "plugin/settings.h":
            original = from_environment(original.decode()).encode()
        copy = source / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not copy.exists() or copy.read_bytes() != original:  # others stay as they are built
            copy.write_bytes(original)
    subprocess.run(["cmake", "--preset", "cpu", "-S", source, "-B", BUILD / "cpu", "-DLAZYCCD_TESTS=ON",
                    "-DLAZYCCD_PRECISIONS=float"], check=True, cwd=source)
    subprocess.run(["cmake", "--build", BUILD / "cpu", "--target", *(Path(p).name for p in PROGRAMS)], check=True)
    (BUILD / "bin").mkdir(exist_ok=True)
    for program in PROGRAMS:
        shutil.copy(BUILD / "cpu" / program, BUILD / "bin")


@contextlib.contextmanager
def taken_from(values):
    value = values.get()
    try:
        yield value
    finally:
        values.put(value)


def failures(folder, environment, processors):
    """Names of what fails, and how long links get: geometric mean over the scenes. Takes a processor of the queue, so
    that programs do not share theirs with the threads of others."""
    with tempfile.TemporaryDirectory() as scratch, taken_from(processors) as processor:
        def run(program, *options):
            return subprocess.run(["taskset", "-c", str(processor), Path(folder).resolve() / program, *options],
                                  env={**os.environ, **environment}, capture_output=True, text=True, cwd=scratch,
                                  timeout=1500)

        failed = set()
        report = f"{scratch}/tests.xml"
        tests = run("lazyccd_tests_bullet", *(f"~{name}" for name in LEFT_OUT), "-r", "junit", "-o", report)
        if tests.returncode < 0:
            failed.add("tests end with a signal")
        else:
            for case in xml.parse(report).iter("testcase"):
                if case.find("failure") is not None or case.find("error") is not None:
                    failed.add("test: " + case.get("name").split("/")[0])
        table = f"{scratch}/behaviour.csv"
        run("lazyccd_behaviour", "--csv", table)
        with open(table) as file:
            failed |= {f"scene: {row['scene']} ({row['world']})" for row in csv.DictReader(file)
                       if row["LazyCCD right"] == "0"}
        lengths = []
        for line in run("lazyccd_stretch", "--rates", "60").stdout.splitlines():
            cells = [cell.strip() for cell in line.split("|")]
            if len(cells) < 15 or not cells[2].isdigit():
                continue
            lengths.append(float(cells[9]))
            if cells[6]:
                failed.add("links: " + " ".join(cells[1:4]))
    return failed, math.exp(sum(map(math.log, lengths)) / len(lengths))


def run(folder, path, names, jobs):
    numbers = numbers_of((ROOT / "plugin/settings.h").read_text(), names)
    processors = queue.Queue()
    for processor in sorted(os.sched_getaffinity(0))[:jobs]:
        processors.put(processor)
    tasks = [("unchanged", "", "1")] + [(*number, factor) for number in numbers for factor in ("0.5", "2")]
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool, open(path, "w", newline="") as file:
        results = pool.map(lambda task: failures(folder, {"LAZYCCD_QUICK_TESTS": "1", task[0]: task[2]},
                                                   processors), tasks)
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["number", "value", "times", "what fails", "links, ratio of their lengths"])
        failed_before, length_before = set(), None
        for (name, value, factor), (failed, length) in zip(tasks, results):
            length_before = length_before or length
            out.writerow([name, value, factor, "; ".join(sorted(failed - failed_before)),
                          round(length / length_before, 2)])
            failed_before = failed_before or failed
            file.flush()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("build", help="build the programs")
    runs = commands.add_parser("run", help="run them with each number halved and doubled")
    runs.add_argument("folder", help="where the programs are")
    runs.add_argument("csv")
    runs.add_argument("names", nargs="*", help="of namespaces or numbers of settings.h; all without")
    runs.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    sys.exit(build() if args.command == "build" else run(args.folder, args.csv, args.names, args.jobs))
