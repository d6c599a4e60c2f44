"""Draws the behaviour scenes from the CSV files that examples/bench/behaviour.sh wrote.

behaviour.py FOLDER reads the CSV files in FOLDER and writes there:
  behaviour   every figure with a bound, Bullet alone and LazyCCD, kept or not (behaviour.csv)
  curve       cost of a simulated second against pass-throughs, by substeps of a frame (curve.csv)
A picture whose CSV file is missing is left out.
"""
import csv
import sys
from pathlib import Path
from statistics import median

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)

# Okabe and Ito's colours, which can be distinguished with any colour vision.
KEPT, BROKEN, NOT_ASKED = "#9CCBE8", "#F0A36B", "#E6E6E6"
# Scenes about what Bullet alone does not have: reported forces, an option of LazyCCD.
ONLY_LAZYCCD = ("contact-forces", "sliding-coulomb")
COLOURS = {"Bullet": "#D55E00", "LazyCCD": "#0072B2"}
WORLDS = ("rigid", "deformable")


def read(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def style():
    plt.rcParams.update({
        "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
        "axes.axisbelow": True,
    })


def save(figure, folder, name):
    figure.savefig(folder / f"{name}.png", dpi=130, bbox_inches="tight")
    plt.close(figure)


def short(text):
    """A number in few characters; numbers beyond any sense are only large."""
    if text == "crashed":
        return text
    x = float(text)
    if x != x or abs(x) == float("inf"):
        return "lost"
    if abs(x) >= 1e5:
        return "huge"
    if abs(x) < 1e-4:
        return "0"
    return f"{x:.0f}" if abs(x) >= 1000 else f"{x:.3g}"


def draw_figures(rows, folder):
    rows = [r for r in rows if r["bound"]]
    lines = list(dict.fromkeys((r["scene"], r["figure"], r["bound"]) for r in rows))
    cells = {(r["scene"], r["figure"], r["world"]): r for r in rows}
    height = 0.2 * len(lines) + 0.8
    figure, a = plt.subplots(figsize=(11, height))
    a.set_xlim(-7.6, 6.4)
    a.set_ylim(len(lines), -1.6)
    a.set_axis_off()
    for w, world in enumerate(WORLDS):
        a.text(2 * w + 1, -1.15, f"{world} world", ha="center", weight="bold")
        for s, side in enumerate(("Bullet", "LazyCCD")):
            a.text(2 * w + s + 0.5, -0.35, side, ha="center")
    a.text(4.15, -0.35, "bound")
    last = None
    for y, (scene, name, bound) in enumerate(lines):
        if scene != last:
            a.plot((-7.6, 6.4), (y, y), color="#cccccc", linewidth=0.6)
            a.text(-7.6, y + 0.68, scene, weight="bold")
        last = scene
        a.text(-0.15, y + 0.68, name, ha="right")
        a.text(4.15, y + 0.68, bound)
        for w, world in enumerate(WORLDS):
            row = cells.get((scene, name, world))
            if not row:
                continue
            for s, side in enumerate(("Bullet", "LazyCCD")):
                colour = KEPT if row[f"{side} right"] == "1" else BROKEN
                if side == "Bullet" and scene in ONLY_LAZYCCD:
                    colour = NOT_ASKED
                a.add_patch(plt.Rectangle((2 * w + s + 0.03, y + 0.06), 0.94, 0.88,
                                          color=colour, linewidth=0))
                a.text(2 * w + s + 0.5, y + 0.68, short(row[side]), ha="center")
    for x, colour, text in ((-7.6, KEPT, "within the bound"), (-5.2, BROKEN, "not within the bound"),
                            (-2.3, NOT_ASKED, "not in Bullet")):
        a.add_patch(plt.Rectangle((x, -1.45), 0.3, 0.5, color=colour, linewidth=0))
        a.text(x + 0.4, -1.03, text)
    save(figure, folder, "behaviour")


def draw_curve(rows, folder):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharey=True)
    top = max(int(r["pass-throughs"]) for r in rows)
    for world, a in zip(WORLDS, axes):
        chosen = [r for r in rows if r["world"] == world]
        scenes = list(dict.fromkeys(r["scene"] for r in chosen))
        for side, colour in COLOURS.items():
            ours = [r for r in chosen if r["collisions"] == side]
            for scene in scenes:
                line = [r for r in ours if r["scene"] == scene and r["completed"] == "1"]
                a.plot([float(r["ms a second"]) for r in line],
                       [int(r["pass-throughs"]) for r in line], color=colour, alpha=0.3,
                       linewidth=0.8, marker=".", markersize=4, clip_on=False)
            counts = sorted({int(r["substeps"]) for r in ours})
            points = []
            for n in counts:
                these = [r for r in ours if int(r["substeps"]) == n]
                done = [r for r in these if r["completed"] == "1"]
                if done:
                    points.append((n, median([float(r["ms a second"]) for r in done]),
                                   median([int(r["pass-throughs"]) for r in done]),
                                   len(these) - len(done)))
            a.plot([p[1] for p in points], [p[2] for p in points], color=colour, linewidth=2.2,
                   marker="o", label="Bullet alone" if side == "Bullet" else "LazyCCD", clip_on=False)
            for i, (n, x, y, lost) in enumerate(points):
                text = f"{n}" + (f" ({lost} lost)" if lost else "")
                # On both sides in turn, so that the labels of close points do not overlap.
                place = (4, 5) if i % 2 == 0 else (4, -13) if y > 0 else (4, 16)
                a.annotate(text, (x, y), textcoords="offset points", xytext=place, color=colour)
        a.set_xscale("log")
        a.set_yscale("symlog", linthresh=1)
        a.set_ylim(0, 2 * top)
        a.axvline(1000, color="#999999", linewidth=0.8, linestyle=":")
        a.text(1000, 1.5 * top, " real time", va="top", color="#777777")
        a.grid(color="#e4e4e4")
        a.set_title(f"{world} world, {len(scenes)} scenes")
        a.set_xlabel("ms of one simulated second")
    axes[0].set_ylabel("pass-throughs")
    axes[0].legend(frameon=False, loc="center left")
    figure.suptitle("Thick: medians over the scenes, with the number of substeps of a frame of 1/60 s; "
                    "thin: each scene; lost: positions not finite, or a crash", fontsize=9)
    figure.tight_layout()
    save(figure, folder, "curve")


def main():
    folder = Path(sys.argv[1])
    style()
    for name, draw in (("behaviour", draw_figures), ("curve", draw_curve)):
        rows = read(folder / f"{name}.csv")
        if rows:
            draw(rows, folder)
            print(folder / f"{name}.png")


if __name__ == "__main__":
    main()
