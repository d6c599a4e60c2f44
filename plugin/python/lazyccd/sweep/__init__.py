"""Parameter sweeps on many cores or machines, by Ray; `python -m lazyccd.sweep --help`.

    from lazyccd.sweep import read, sweep
    from lazyccd.sweep import scenes

    sweep(scenes, {"speed": [1, 10], "seed": [0, 1, 2]}, "out", workers=2)
    table = read("out")                                      # a pyarrow.Table, one row for each point

A sweep needs the extra packages of `pip install lazyccd[sweep]`. A task is a module:

- ``AXES``: a dict from the name of each axis to its values.
- ``run(point, **settings)``: measures one point, a dict from axis to value, and returns a dict of figures.
- ``points(axes, **settings)``: optional, yields the points; without it they are the product of the axes.
- ``TIMINGS``: optional, names of the figures that differ from run to run.
- ``draw(table, folder)``: optional, draws the map and returns its path; `chart.draw` without it.
"""

from .driver import sweep
from .store import read

__all__ = ["read", "sweep"]
