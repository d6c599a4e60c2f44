#!/usr/bin/env python3
"""Draws the cost of a step over the number of sleepers from the CSV file of lazyccd_sleeper_costs.

    sleeper_chart.py sleepers.csv sleepers.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main() -> None:
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    figure, axes = plt.subplots(1, len(worlds), figsize=(9, 3.4))
    for world, axis in zip(worlds, axes.flat):
        own = [row for row in rows if row["world"] == world]
        sleepers = [int(row["sleepers"]) for row in own]
        for column in ("Bullet alone", "with LazyCCD", "LazyCCD's own part"):
            axis.plot(sleepers, [float(row[column]) for row in own], marker="o", label=column)
        axis.set_xscale("symlog", linthresh=10)
        axis.set_yscale("log")
        axis.set_title(f"one cloth awake, {world} world", fontsize=10)
        axis.set_xlabel("cloths asleep")
        axis.set_ylabel("ms a step")
        axis.grid(alpha=0.3)
    axes.flat[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
