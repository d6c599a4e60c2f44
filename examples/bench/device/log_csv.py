"""Writes a CSV file from the log of a program that checks and times the GPU.

    log_csv.py exact|hierarchy|steps LOG CSV

exact: of lazyccd_device_costs. hierarchy: of check_hierarchy. steps: of the part `drop` of tests/gpu/run.sh.
"""
import csv
import re
import sys
from pathlib import Path


def exact(log):
    yield "scene", "exact", "device", "whole"
    yield from re.findall(r"^(.+?) +contacts +\d+ exact +(\d+) device +([\d.]+) .*whole +([\d.]+)", log, re.MULTILINE)


def hierarchy(log):
    yield ("scene", "faces", "device ms", "host and upload ms", "edges on the CPU ms",
           "new topology and first detection ms")
    found = re.findall(r"^TIME +(.+?): device ([\d.]+) ms; host with upload ([\d.]+) ms, mesh ([\d.]+) ms", log,
                       re.MULTILINE)
    for scene, topology in re.findall(r"^TIME +(.+?): last step.*detection ([\d.]+) ms", log, re.MULTILINE):
        times = next(rest for name, *rest in found if name.startswith(f"{scene},"))
        if re.search(r"\d{4,}$", scene):
            yield scene, scene.split()[-1], *times, topology


WITH = {"--detector bullet": "Bullet alone", "--backend cpu": "CPU", "--backend cuda": "GPU"}


def steps(log):
    yield "scene", "size", "with", "ms", "pass-throughs"
    for size, option, ms, passed in re.findall(r"^drop size (\d+) (--\w+ \w+): .*?total ([\d.]+).*; (\d+) pass", log,
                                               re.MULTILINE):
        yield "drop", size, WITH[option], ms, passed


def main():
    kind, log, out = sys.argv[1:]
    rows = {"exact": exact, "hierarchy": hierarchy, "steps": steps}[kind](Path(log).read_text())
    with open(out, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
