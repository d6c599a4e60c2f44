#!/usr/bin/env python3
"""Writes the tables of the result pages from their CSV files. Measures nothing; needs Python alone.

pages.py [--check] [PAGE...]           PAGE: costs, gpu, ...; default: all
pages.py --ran FILE... -- COMMAND      notes that the command wrote these CSV files here, in results/runs.csv

In a page, a table stands between two lines, and so does the line that says where its numbers are from:

    <!-- run costs/untuned.csv -->                <!-- table costs/untuned -->
    <!-- end -->                                  <!-- end -->

The folder bench/tables has the columns. --check changes nothing and fails if a page is not up to date.
"""
import csv
import re
import subprocess
import sys
from pathlib import Path

from machine import machine
from tables import accuracy, behaviour, costs, gpu, strategies, users  # noqa: F401  (they register tables)
from tables.common import RESULTS, TABLES, distinct

RUNS = RESULTS / "runs.csv"
COLUMNS = ["file", "machine", "commit", "command"]
PART = re.compile(r"(<!-- (table|run) (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def read_runs():
    with open(RUNS, newline="") as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def markdown(heading, rows):
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (heading, ["---"] * len(heading), *rows))


def run_line(name):
    run = read_runs().get(name)
    if not run:
        return "Not measured yet.\n"
    return (f"**Machine:** {run['machine']}. **Commit:** {run['commit']}. **Command:** `{run['command']}`. "
            f"**All numbers:** [{name}]({name}).\n")


def index():
    """The table of all pages: what each answers is its first sentence."""
    runs, rows = read_runs(), []
    for path in sorted(RESULTS.glob("*.md")):
        if path.name == "README.md":
            continue
        page = path.read_text()
        own = [runs[name] for _, kind, name, _ in PART.findall(page) if kind == "run" and name in runs]
        rows.append([f"[{path.stem}]({path.name})", page.split("\n\n")[1].replace("\n", " "),
                     "; ".join(distinct(run["machine"] for run in own)),
                     "; ".join(distinct(run["commit"] for run in own)), f"`bash examples/bench/all.sh {path.stem}`"])
    return ["page", "what it answers", "machines", "commits", "command"], rows


def render(page):
    def part(match):
        begin, kind, name, end = match.groups()
        if kind == "run":
            return begin + run_line(name) + end
        found = index() if name == "index" else TABLES[name]()
        return begin + (markdown(*found) if found else "") + end

    return PART.sub(part, page)


def note(files, command):
    git = ["git", "-C", str(RESULTS)]
    commit = subprocess.run([*git, "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True).stdout.strip()
    changed = subprocess.run([*git, "status", "--porcelain", "-uno", "--", ":/cuda", ":/plugin"], capture_output=True,
                             text=True).stdout
    runs = read_runs()
    for name in files:
        runs[name] = dict(zip(COLUMNS, (name, machine(), commit + (" with changes" if changed else ""), command)))
    with open(RUNS, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(sorted(runs.values(), key=lambda run: run["file"]))


def main():
    arguments = sys.argv[1:]
    if arguments[:1] == ["--ran"]:
        place = arguments.index("--")
        return note(arguments[1:place], " ".join(arguments[place + 1:]))
    check = "--check" in arguments
    wanted = [name for name in arguments if name != "--check"] or [path.stem for path in RESULTS.glob("*.md")]
    old = []
    for name in [*wanted, "README"]:
        path = RESULTS / f"{name}.md"
        before = path.read_text()
        after = render(before)
        if after != before:
            old.append(path.name)
            if not check:
                path.write_text(after)
    for name in distinct(old):
        print(f"{name}: its tables are not those of the CSV files; run examples/bench/pages.py" if check else name)
    sys.exit(check and bool(old))


if __name__ == "__main__":
    main()
