"""Table and picture of the main job: a scene with Bullet alone and with LazyCCD, side by side.

compare.py FOLDER OUT.png: FOLDER holds bullet/ and lazyccd/, each with stats.json and the pictures
that `lazyccd simulate --render` drew.
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

DETECTORS = [("bullet", "Bullet alone", "#c1272d"), ("lazyccd", "Bullet with LazyCCD", "#1b7a43")]
PIXELS_AN_INCH = 150


def main(folder, out):
    stats = {name: json.loads((folder / name / "stats.json").read_text()) for name, _, _ in DETECTORS}
    pictures = {name: plt.imread(max((folder / name).glob("*.png"))) for name, _, _ in DETECTORS}
    row = "{:<20} {:>6} {:>10} {:>14} {:>18} {:>10}"
    print(row.format("backend", "steps", "contacts", "pass-throughs", "piercings at rest", "ms a step"))
    height, width, _ = pictures["bullet"].shape
    caption = 0.16 * height
    figure, panels = plt.subplots(1, 2, figsize=(2 * width / PIXELS_AN_INCH,
                                                 (height + caption) / PIXELS_AN_INCH))
    for axes, (name, title, colour) in zip(panels, DETECTORS):
        s = stats[name]
        crossed = sum(s["pass_throughs"].values())
        # Bullet alone knows only the contacts in its lists.
        contacts = sum(s["contacts"].values()) if name == "lazyccd" else s["contacts_in_bullets_lists"]
        print(row.format(title, s["steps"], contacts, crossed, s["piercings"],
                         f"{s['ms_per_step']['total']:.2f}"))
        axes.imshow(pictures[name])
        axes.axis("off")
        red = " (red)" if s["piercings"] else ""
        axes.text(0.5, 1.115, title, transform=axes.transAxes, ha="center", va="center",
                  fontsize=13, fontweight="bold", color=colour)
        axes.text(0.5, 1.04, f"{crossed} pass-throughs, {s['piercings']} piercings at rest{red}",
                  transform=axes.transAxes, ha="center", va="center", fontsize=11, color="#333333")
    figure.subplots_adjust(0, 0, 1, height / (height + caption), 0.004)
    figure.savefig(out, dpi=PIXELS_AN_INCH)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
