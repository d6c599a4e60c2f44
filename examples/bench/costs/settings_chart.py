#!/usr/bin/env python3
"""Draws each fixed setting of a study against the default one, from the CSV file of `lazyccd study`.

    settings_chart.py cpu.csv cpu.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

COLOURS = {"box": "tab:blue", "dop18": "tab:orange", "oriented_box": "tab:green"}


def is_default(row: dict) -> bool:
    return (row["volume"], row["front"], row["culling"]) == ("box", "auto", "default")


def main() -> None:
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    models = list(dict.fromkeys(row["model"] for row in rows))
    figure, axis = plt.subplots(figsize=(7, 3.2))
    for place, model in enumerate(models):
        own = [row for row in rows if row["model"] == model]
        default = next(float(row["ms_total"]) for row in own if is_default(row))
        for row in own:
            axis.plot(float(row["ms_total"]) / default, place, "o", ms=4, color=COLOURS[row["volume"]])
        axis.plot(1, place, "kD", ms=7, fillstyle="none")
    for volume, colour in COLOURS.items():
        axis.plot([], [], "o", ms=4, color=colour, label=volume.replace("_", " "))
    axis.plot([], [], "kD", ms=7, fillstyle="none", label="the default")
    axis.set_yticks(range(len(models)), models)
    axis.invert_yaxis()
    axis.set_xscale("log")
    ticks = (0.7, 1, 1.5, 2)
    axis.set_xticks(ticks, [str(tick) for tick in ticks])
    axis.minorticks_off()
    axis.set_xlabel("time of a detection / time with the default settings")
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
