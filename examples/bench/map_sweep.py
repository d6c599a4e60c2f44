"""The map of map.py as a task of the Python package's sweep: many machines, Parquet files, resumption.

    python -m lazyccd.sweep build/map --task examples/bench/map_sweep.py --axis scene=fold,twist
    python -m lazyccd.sweep build/map --task examples/bench/map_sweep.py --set quick=1

The rows are those of map.py; map.csv and the pictures are written beside them. The setting `programs` is the folder
of the programs lazyccd and lazyccd_double, build/cpu/examples by default.
"""
import csv
from pathlib import Path

from map import DRAWN, FOUND, FULL, POINT, QUICK, draw as draw_rows, measure, points as points_of, print_table

AXES = {"scene": list(FULL), "detector": list(DRAWN)}
TIMINGS = ("ms_step",)
REPOSITORY = Path(__file__).resolve().parents[2]


def points(axes, programs="", quick=0):
    of_scene = QUICK if quick else FULL
    chosen = {scene: of_scene[scene] for scene in axes["scene"] if scene in of_scene}
    for point in points_of(chosen, axes["detector"]):
        yield dict(zip(POINT, point))


def run(point, programs="build/cpu/examples", quick=0):
    row = measure(REPOSITORY / programs, [point[name] for name in POINT])
    return {name: str(row[name]) for name in FOUND if name in row}


def draw(table, folder):
    rows = [{name: row.get(name) or "" for name in POINT + FOUND} for row in table.to_pylist()]
    rows.sort(key=lambda row: [row[name] for name in POINT])
    with open(Path(folder) / "map.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, POINT + FOUND)
        writer.writeheader()
        writer.writerows(rows)
    print_table(rows)
    draw_rows(rows, Path(folder))
    return Path(folder) / "map.png"
