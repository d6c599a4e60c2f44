"""Writes a CSV file from the statistics that `lazyccd simulate --stats` wrote: one row each, medians of several runs.

    stats_csv.py CSV NAME="FILE FILE..." ...
"""
import csv
import json
import sys
from pathlib import Path
from statistics import median

COLUMNS = {
    "ms a step": lambda run: run["ms_per_step"]["total"],
    "pass-throughs": lambda run: sum(run["pass_throughs"].values()),
    "intersections": lambda run: run["intersections"],
    "end speed mm/s": lambda run: 1e3 * run["end_speed_m_s"]["rms"],
}


def main():
    with open(sys.argv[1], "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["with", *COLUMNS])
        for argument in sys.argv[2:]:
            name, files = argument.split("=", 1)
            runs = [json.loads(Path(path).read_text()) for path in files.split()]
            writer.writerow([name, *(f"{median(map(value, runs)):.8g}" for value in COLUMNS.values())])


if __name__ == "__main__":
    main()
