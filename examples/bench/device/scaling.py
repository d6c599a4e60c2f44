"""Draws the chart of lazyccd_device_scaling and prints its tables.

scaling.py CSV [--chart FILE]
"""
import argparse
import csv

LINES = [
    ("whole_ms", "whole, from and to the host", "o"),
    ("resident_ms", "positions and contacts on the device", "s"),
    ("device_ms", "device", "."),
    ("rebuild_ms", "rebuild of the hierarchy", "v"),
    ("new_topology_ms", "new topology and first detection", "^"),
    ("thread_per_query_device_ms", "device, one thread a query", "x"),
    ("cpu_ms", "CPU, 16 threads", "d"),
]


def read(path):
    with open(path, newline="") as file:
        rows = [{key: value if key == "scene" else float(value) for key, value in row.items()}
                for row in csv.DictReader(file)]
    # -1: not measured. The rebuild is a difference of two times, and may be lost in them.
    return [{key: None if key.endswith("_ms") and value <= 0 else value for key, value in row.items()}
            for row in rows]


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(12, 5), sharey=True)
    for axis, scene, size, label in [(axes[0], "sheets", "faces", "triangles"),
                                     (axes[1], "worlds", "worlds", "worlds of 10 bodies, 1 620 triangles each")]:
        points = [row for row in rows if row["scene"] == scene]
        for column, name, marker in LINES:
            known = [row for row in points if row[column] is not None]
            axis.plot([row[size] for row in known], [row[column] for row in known], marker=marker, label=name)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel(label)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("milliseconds")
    axes[0].legend(fontsize="small")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def show(rows):
    columns = [column for column, _, _ in LINES]
    print("| scene | worlds | faces | contacts | " + " | ".join(name for _, name, _ in LINES) + " | bytes a face |")
    print("|---" * (len(LINES) + 5) + "|")
    for row in rows:
        times = ["" if row[column] is None else f"{row[column]:.4g}" for column in columns]
        counts = [f"{int(row[key]):,}".replace(",", " ") for key in ("worlds", "faces", "contacts")]
        print(f"| {row['scene']} | " + " | ".join(counts + times) + f" | {row['bytes_a_face']:.0f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv")
    parser.add_argument("--chart")
    arguments = parser.parse_args()
    rows = read(arguments.csv)
    show(rows)
    if arguments.chart:
        draw(rows, arguments.chart)


if __name__ == "__main__":
    main()
