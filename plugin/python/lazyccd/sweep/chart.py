"""Draws a sweep as a map: panels with one colour for each point, the mean over all other axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple


def _sorted(values: Sequence[Any]) -> List[Any]:
    try:
        return sorted(set(values))
    except TypeError:
        return sorted(set(values), key=str)


def _label(value: Any) -> str:
    if isinstance(value, float) and 0 < value < 0.05 and abs(1 / value - round(1 / value)) < 1e-6:
        return f"1/{round(1 / value)}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def draw(
    table: Any,
    folder: str,
    x: str = "speed",
    y: str = "dt",
    value: str = "wrong",
    panels: Sequence[str] = ("scene", "solver"),
    name: str = "map",
    title: Optional[str] = None,
) -> str:
    """Draws `value` over the axes `x` and `y`, a panel for each combination of `panels`; returns the picture's path.

    A cell is the mean over all other axes. Cells without a number are grey.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    rows = table.to_pylist()
    across, up = _sorted([row[x] for row in rows]), _sorted([row[y] for row in rows])
    groups: Dict[Tuple[Any, ...], List[Dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[panel] for panel in panels), []).append(row)
    columns = len(_sorted([key[-1] for key in groups])) if len(panels) > 1 else min(4, len(groups))
    lines = -(-len(groups) // columns)
    figure, grid = plt.subplots(
        lines, columns, figsize=(1.6 + 0.55 * len(across) * columns + 0.8 * columns, 1.2 + (1.1 + 0.45 * len(up)) * lines),
        squeeze=False, layout="constrained",
    )
    highest = max([_number(row.get(value)) for row in rows if row.get(value) is not None] or [1]) or 1
    image = None
    for axes, key in zip(grid.ravel(), sorted(groups, key=str)):
        cells = np.full((len(up), len(across)), np.nan)
        for j, at_y in enumerate(up):
            for i, at_x in enumerate(across):
                found = [_number(row.get(value)) for row in groups[key] if (row[x], row[y]) == (at_x, at_y)]
                if found:
                    cells[j, i] = np.mean(found)
                    axes.text(i, j, f"{cells[j, i]:.3g}", ha="center", va="center", fontsize=7)
        axes.set_facecolor("#bbbbbb")
        image = axes.imshow(cells, cmap="YlOrRd", vmin=0, vmax=highest, aspect="auto", origin="lower", alpha=0.8)
        axes.set_xticks(range(len(across)), [_label(v) for v in across])
        axes.set_yticks(range(len(up)), [_label(v) for v in up])
        axes.set_title(", ".join(str(part) for part in key), fontsize=9)
        axes.set_xlabel(x)
        axes.set_ylabel(y)
    for axes in grid.ravel()[len(groups):]:
        axes.set_axis_off()
    if image is not None:
        figure.colorbar(image, ax=grid, label=value)
    if title:
        figure.suptitle(title)
    path = Path(folder) / f"{name}.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return str(path)
