"""Draws pictures of speed against accuracy from the CSV files that examples/bench/accuracy/chart.sh wrote.

chart.py FOLDER reads queries.csv and steps.csv in FOLDER and writes there, as PNG:
  accuracy      elementary tests, over all queries of the broad-phase sets
  missed_by_set, false_hits_by_set, times_by_set
                the same, with one panel for each set of queries
  steps         whole steps, with one panel for each scene
"""
import csv
import math
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)
from matplotlib.ticker import FuncFormatter  # noqa: E402

# Okabe and Ito's colours, which can be distinguished with any colour vision. Marker shapes show precision.
COLOURS = {
    "LazyCCD": "#D55E00",
    "cubic, Newton-bisection": "#0072B2",
    "non-coplanar filter": "#777777",
    "interval subdivision": "#009E73",
    "Bullet": "#CC79A7",
}
MARKERS = {"float": "^", "double": "o", "in lanes": "*", "float first": "D", "double only": "s"}
POOL_BROAD, POOL_ALL = "broad phase", "all sets"


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def style():
    plt.rcParams.update({
        "font.size": 10, "axes.spines.top": False, "axes.spines.right": False,
        "axes.grid": True, "grid.color": "#e4e4e4", "axes.axisbelow": True,
        "figure.dpi": 100,
    })


def colour(method):
    return next(c for name, c in COLOURS.items() if method.startswith(name))


def draw(axes, x, y, method, precision, small=False):
    ours = method.startswith("LazyCCD")
    marker = MARKERS.get(precision, "*")
    axes.plot([x], [y], linestyle="none", marker=marker,
              markersize=(6 if small else 9) * (1.8 if marker == "*" else 1), color=colour(method),
              markeredgecolor="white", markeredgewidth=0.6, zorder=4 if ours else 3, clip_on=False)


def merged(axes, points):
    """Merges the labels of near points with the same method and remark.

    Takes (x, y, method, precision, remark) and returns a list of (x, y, text, colour)."""
    groups = []
    for x, y, method, precision, remark in sorted(points, key=lambda p: p[0]):
        px, py = axes.transData.transform((x, y))
        near = [g for g in groups
                if g["name"] == (method, remark) and abs(g["py"] - py) < 8 and px - g["px"] < 60]
        if near:
            near[0]["precisions"].append(precision)
            near[0]["px"] = px
        else:
            groups.append({"name": (method, remark), "precisions": [precision],
                           "x": x, "y": y, "px": px, "py": py})
    return [(g["x"], g["y"], f"{g['name'][0]}, {' / '.join(g['precisions'])}{g['name'][1]}",
             colour(g["name"][0])) for g in groups]


def label_points(figure, axes, points):
    """Labels each (x, y, method, precision, remark) at a place that hides no point and no other label."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    taken = []
    for x, y, *_ in points:
        px, py = axes.transData.transform((x, y))
        taken.append(matplotlib.transforms.Bbox.from_extents(px - 7, py - 7, px + 7, py + 7))
    frame = axes.get_window_extent(renderer)
    places = [(10, 0, "left"), (-10, 0, "right"), (-4, 14, "left"), (-4, -14, "left"),
              (4, 14, "right"), (4, -14, "right"), (-4, 27, "left"), (4, 27, "right"),
              (-4, 40, "left")]
    # LazyCCD first: it gets the best place.
    labels = sorted(merged(axes, points), key=lambda label: not label[2].startswith("LazyCCD"))
    for x, y, text, shade in labels:
        for dx, dy, align in places:
            note = axes.annotate(text, (x, y), (dx, dy), textcoords="offset points", ha=align,
                                 va="center", color=shade, fontsize=8.5)
            box = note.get_window_extent(renderer)
            inside = box.x1 < frame.x1 + 20 and box.x0 > frame.x0 + 2 and box.y0 > frame.y0
            if inside and not any(box.overlaps(other) for other in taken):
                break
            note.remove()
        else:
            note = axes.annotate(text, (x, y), (10, 0), textcoords="offset points", va="center",
                                 color=shade, fontsize=8.5)
            box = note.get_window_extent(renderer)
        taken.append(box)


def plain_percent(value, _):
    return "0" if value == 0 else f"{value:g} %"


def time_of(nanoseconds, _):
    if nanoseconds >= 1e6:
        return f"{nanoseconds / 1e6:g} ms"
    return f"{nanoseconds / 1e3:g} µs" if nanoseconds >= 1e3 else f"{nanoseconds:g} ns"


def percent_axis(axes, smallest):
    """Makes a logarithmic axis with zero, the best value, on a line of its own below."""
    axes.set_yscale("symlog", linthresh=smallest, linscale=0.7)
    axes.set_ylim(-1.3 * smallest, 150)
    axes.set_yticks([0] + [t for t in (0.001, 0.01, 0.1, 1, 10, 100) if t >= smallest])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(FuncFormatter(plain_percent))


def time_axis(axes):
    """Makes an axis for errors of the time of impact, in steps. 1e-16 is the resolution of double."""
    axes.set_yscale("log")
    axes.set_ylim(2e-17, 1e-1)
    axes.set_yticks([1e-16, 1e-12, 1e-8, 1e-4])
    axes.minorticks_off()


def missed_percent(row):
    true = int(row["truly_touching"])
    return 100 * int(row["missed"]) / true if true else 0.0


def false_percent(row):
    apart = int(row["decided"]) - int(row["truly_touching"])
    return 100 * int(row["false_hits"]) / apart if apart else 0.0


def time_error(row):
    return max(abs(float(row["toi_early_median"])), 1e-16) if row["toi_early_median"] else None


MISSED = ("missed contacts, as a share of pairs that truly touch", missed_percent,
          lambda axes: percent_axis(axes, 0.01))
FALSE = ("false hits, as a share of pairs that do not touch", false_percent,
         lambda axes: percent_axis(axes, 0.001))
TIME = ("median error of the time of impact, as a share of the step", time_error, time_axis)


def save(figure, folder, name):
    figure.savefig(folder / f"{name}.png", dpi=150, bbox_inches="tight")
    plt.close(figure)


def best_rows(rows, name):
    """Returns one row a method: over both kinds of query, or over vertex-face if it has no other."""
    chosen = {}
    for row in rows:
        key = (row["method"], row["precision"])
        if row["set"] != name or (row["kind"] != "both" and key in chosen):
            continue
        if row["kind"] == "both" and row["method"] == "Bullet":
            continue
        if row["kind"] in ("both", "vf"):
            chosen[key] = row
    return list(chosen.values())


def picture_pool(rows, folder, machine):
    pool = POOL_BROAD if any(r["set"] == POOL_BROAD for r in rows) else POOL_ALL
    chosen = best_rows(rows, pool)
    figure, panels = plt.subplots(3, 1, figsize=(8.2, 9.6), sharex=True)
    for axes, (title, value, scale) in zip(panels, (MISSED, FALSE, TIME)):
        axes.set_xscale("log")
        points = []
        for row in chosen:
            x, y = float(row["ns_per_query"]), value(row)
            if y is None:
                continue
            remark = " (VF only)" if row["method"] == "Bullet" else ""
            if value is time_error:
                remark += f": {row['toi_late']} late" if int(row["toi_late"]) else ": never late"
            draw(axes, x, y, row["method"], row["precision"])
            points.append((x, y, row["method"], row["precision"], remark))
        axes.set_title(title, loc="left", fontsize=10)
        axes.xaxis.set_major_formatter(FuncFormatter(time_of))
        scale(axes)
        label_points(figure, axes, points)
    panels[-1].set_xlabel("mean time per query, one thread")
    total = max(chosen, key=lambda r: int(r["queries"]))
    what = {POOL_BROAD: "pairs that a broad phase yields",
            POOL_ALL: "queries, degenerate ones included"}[pool]
    figure.suptitle(f"Elementary tests on {total['queries']} {what}: left and low is better\n"
                    f"{machine}, one thread, medians of {total['rounds']} rounds",
                    x=0.02, ha="left", fontsize=11)
    figure.tight_layout()
    save(figure, folder, "accuracy")


def picture_sets(rows, folder, machine, name_of_file, quantity):
    title, value, scale = quantity
    names = []
    for row in rows:
        if row["set"] not in names and row["set"] not in (POOL_BROAD, POOL_ALL):
            names.append(row["set"])
    across = 4
    down = math.ceil((len(names) + 1) / across)
    figure, grid = plt.subplots(down, across, figsize=(12, 2.3 * down), sharex=True, sharey=True)
    for axes, name in zip(grid.flat, names):
        axes.set_xscale("log")
        scale(axes)
        axes.set_title(name, fontsize=9, loc="left")
        axes.xaxis.set_major_formatter(FuncFormatter(time_of))
        axes.tick_params(labelsize=7)
        for row in rows:
            y = value(row) if row["set"] == name else None
            if y is not None:
                draw(axes, float(row["ns_per_query"]), y, row["method"], row["precision"],
                     small=True)
    rest = list(grid.flat)[len(names):]
    for axes in rest:
        axes.axis("off")
    seen = {(r["method"], r["precision"]) for r in rows}
    handles = [plt.Line2D([], [], linestyle="none", color=colour(m), marker=marker,
                          markersize=11 if marker == "*" else 7, label=f"{m}, {p}")
               for m in COLOURS for p, marker in MARKERS.items() if (m, p) in seen]
    rest[0].legend(handles=handles, loc="upper left", fontsize=8, frameon=False)
    figure.suptitle(f"{title[0].upper()}{title[1:]}, against mean time per query, by set; "
                    f"one point each for vertex-face and edge-edge\n{machine}, one thread",
                    x=0.02, ha="left", fontsize=10)
    figure.tight_layout()
    save(figure, folder, name_of_file)


def milliseconds(value):
    return f"{value:.0f} ms" if value >= 100 else f"{value:.3g} ms"


def picture_steps(rows, folder, machine):
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, panels = plt.subplots(1, len(scenes), figsize=(4.4 * len(scenes), 4), squeeze=False)
    for axes, scene in zip(panels[0], scenes):
        axes.set_xscale("log")
        points = []
        for row in rows:
            if row["scene"] != scene or "built anew" in row["method"]:
                continue
            ours = row["method"].startswith("LazyCCD")
            true = int(row["true_vf"] or 0) + int(row["true_ee"] or 0)
            wrong = int(row["missed_vf"] or 0) + int(row["missed_ee"] or 0)
            x, y = float(row["median_ms"]), 100 * wrong / true if true else 0
            method = "LazyCCD" if ours else "Bullet"
            draw(axes, x, y, method, "in lanes" if ours else row["precision"])
            threads = f"{row['threads']} thread" + ("s" if row["threads"] != "1" else "")
            setting = threads if ours else row["precision"]
            points.append((x, y, f"{setting}, {milliseconds(x)}", method))
        faces = next(r["faces"] for r in rows if r["scene"] == scene)
        axes.set_title(f"{scene}, {faces} triangles", loc="left", fontsize=10)
        axes.set_ylim(-4, 118)
        axes.set_xlim(min(p[0] for p in points) / 2, max(p[0] for p in points) * 2.5)
        axes.yaxis.set_major_formatter(FuncFormatter(plain_percent))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda ms, _: f"{ms:g} ms"))
        axes.xaxis.set_minor_formatter(FuncFormatter(lambda ms, _: ""))
        axes.set_xlabel("time of a whole step")
        for method in ("LazyCCD", "Bullet"):
            mine = sorted((p for p in points if p[3] == method), key=lambda p: -p[1])
            # LazyCCD's labels are stacked above its points; each label of Bullet is left of its point.
            for index, (x, y, text, _) in enumerate(mine):
                if method == "LazyCCD":
                    place, across, up = (0, 12 + 13 * index), "left", "bottom"
                else:
                    place, across = (-9, 5 if index == 0 else -5), "right"
                    up = "bottom" if index == 0 else "top"
                axes.annotate(f"{method}, {text}", (x, y), place, textcoords="offset points",
                              ha=across, va=up, color=colour(method), fontsize=8.5)
    panels[0][0].set_ylabel("missed contacts,\nvertex-face and edge-edge")
    figure.suptitle("Whole steps: LazyCCD finds every contact; one pass of Bullet's own detection, "
                    "one thread, tests vertex-face only\n" + machine,
                    x=0.02, ha="left", fontsize=11)
    figure.tight_layout()
    save(figure, folder, "steps")


def main():
    folder = Path(sys.argv[1])
    style()
    queries = read(folder / "queries.csv")
    picture_pool(queries, folder, queries[0]["machine"])
    for name, quantity in (("missed_by_set", MISSED), ("false_hits_by_set", FALSE),
                           ("times_by_set", TIME)):
        picture_sets(queries, folder, queries[0]["machine"], name, quantity)
    steps = read(folder / "steps.csv")
    picture_steps(steps, folder, steps[0]["machine"])
    print("\n".join(str(path) for path in sorted(folder.glob("*.png"))))


if __name__ == "__main__":
    main()
