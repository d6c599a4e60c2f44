#!/usr/bin/env python3
"""Draws the cost of a step over time from the CSV file of lazyccd_phase_costs.

    phase_chart.py phases.csv phases.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main() -> None:
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    scenes = list(dict.fromkeys((row["scene"], row["world"]) for row in rows))
    figure, axes = plt.subplots(len(scenes) // 2, 2, figsize=(9, 2.4 * len(scenes) / 2), sharex=True)
    for (scene, world), axis in zip(scenes, axes.flat):
        own = [row for row in rows if (row["scene"], row["world"]) == (scene, world)]
        time = [float(row["s"]) for row in own]
        for column in ("Bullet alone", "with LazyCCD"):
            axis.semilogy(time, [float(row[column]) for row in own], label=column)
        axis.set_title(f"{scene}, {world} world", fontsize=9)
        axis.grid(alpha=0.3)
        axis.set_ylabel("ms a step")
    for axis in axes[-1]:
        axis.set_xlabel("simulated time, s")
    axes.flat[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
