"""What each number of plugin/settings.h is for: halves and doubles it, and says which scene fails then.

  python3 tests/long/numbers.py build                     # into build/numbers, once for each change of the code
  python3 tests/long/numbers.py run FOLDER CSV NAMESPACE...   # FOLDER: build/numbers/bin

The build is the ordinary one, but for settings.h: its numbers are read from the environment when a program starts.
Scenes: quick tests of the adapter, behaviour scenes, links at 1/60 s (lazyccd_stretch), all in single precision.
"""
import argparse
import concurrent.futures
import csv
import math
import os
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
         "shapes.cylinder_end", "shapes.cylinder_side", "shapes.exit_tolerance", "shapes.plane_square_ratio"]
DECLARATION = re.compile(r"inline constexpr (double|float|int) ([^;{}]+);")


def numbers_of(settings, namespaces):
    """Name, type and value of each number, as they stand in settings.h."""
    for namespace in re.finditer(r"namespace (\w+) \{(.*?)\}  // namespace \1", settings, re.S):
        if namespaces and namespace[1] not in namespaces:
            continue
        for declaration in DECLARATION.finditer(namespace[2]):
            for part in declaration[2].split(", "):
                name, value = part.split(" = ", 1)
                if f"{namespace[1]}.{name.strip()}" not in FIXED:
                    yield f"{namespace[1]}.{name.strip()}", declaration[1], value


def from_environment(settings):
    """settings.h with numbers that the environment may multiply. Those of a fixed size stay as they are."""
    out, namespace = [], ""
    head = ("#include <cstdlib>\n\nnamespace lazyccd::bullet::settings {\n"
            "template <class T>\nT times(const char* name, T value) {\n"
            "  const char* const found = std::getenv(name);\n"
            "  return found ? static_cast<T>(std::atof(found) * static_cast<double>(value)) : value;\n}\n}\n")
    position = 0
    for match in re.finditer(r"namespace (\w+) \{|" + DECLARATION.pattern, settings):
        out.append(settings[position:match.start()])
        position = match.end()
        if match[1]:
            namespace = match[1]
            out.append(match[0])
            continue
        for part in match[3].split(", "):
            name, value = part.split(" = ", 1)
            if f"{namespace}.{name.strip()}" in FIXED:
                out.append(f"inline constexpr {match[2]} {part};")
                continue
            out.append(f'inline const {match[2]} {name.strip()} = times<{match[2]}>("{namespace}.{name.strip()}", {value});')
    return ("".join(out) + settings[position:]).replace("namespace lazyccd::bullet::settings {", head +
                                                       "\nnamespace lazyccd::bullet::settings {", 1)


def build():
    source = BUILD / "source"
    files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=True).stdout
    for name in filter(None, files.split("\0")):
        copy = source / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not copy.exists() or copy.read_bytes() != (ROOT / name).read_bytes():
            shutil.copy(ROOT / name, copy)
    (source / "plugin/settings.h").write_text(from_environment((ROOT / "plugin/settings.h").read_text()))
    subprocess.run(["cmake", "--preset", "cpu", "-S", source, "-B", BUILD / "cpu", "-DLAZYCCD_TESTS=ON",
                    "-DLAZYCCD_PRECISIONS=float"], check=True, cwd=source)
    subprocess.run(["cmake", "--build", BUILD / "cpu", "--target", *(Path(p).name for p in PROGRAMS)], check=True)
    (BUILD / "bin").mkdir(exist_ok=True)
    for program in PROGRAMS:
        shutil.copy(BUILD / "cpu" / program, BUILD / "bin")


def failures(folder, environment):
    """Names of what fails, and how long links get: geometric mean over the scenes."""
    with tempfile.TemporaryDirectory() as scratch:
        def run(program, *options):
            return subprocess.run([Path(folder).resolve() / program, *options], env={**os.environ, **environment},
                                  capture_output=True, text=True, cwd=scratch, timeout=1500)

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
            if len(cells) < 9 or not cells[2].isdigit():
                continue
            lengths.append(float(cells[6].strip("*").split(",")[0].strip("*")))
            if "**" in cells[6]:
                failed.add("links: " + " ".join(cells[1:4]))
    return failed, math.exp(sum(map(math.log, lengths)) / len(lengths))


def run(folder, path, namespaces, jobs):
    names = list(numbers_of((ROOT / "plugin/settings.h").read_text(), namespaces))
    tasks = [("", "", "", "")] + [(*number, factor) for number in names for factor in ("0.5", "2")]
    environment = {"LAZYCCD_QUICK_TESTS": "1"}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool, open(path, "w", newline="") as file:
        results = pool.map(lambda task: failures(folder, {**environment, **({task[0]: task[3]} if task[0] else {})}), tasks)
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["number", "value", "times", "what fails", "links, ratio of their lengths"])
        unchanged = None
        for (name, _, value, factor), (failed, length) in zip(tasks, results):
            unchanged = unchanged or (failed, length)
            out.writerow([name or "unchanged", value, factor, "; ".join(sorted(failed - unchanged[0]) if name else sorted(failed)),
                          round(length / unchanged[1], 2)])
            file.flush()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("build", help="build the programs")
    runs = commands.add_parser("run", help="run them with each number halved and doubled")
    runs.add_argument("folder", help="where the programs are")
    runs.add_argument("csv")
    runs.add_argument("namespaces", nargs="*", help="of settings.h; all without")
    runs.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    sys.exit(build() if args.command == "build" else run(args.folder, args.csv, args.namespaces, args.jobs))
