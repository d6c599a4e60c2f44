"""Compares a scene with Bullet alone and with LazyCCD: prints a table and draws both side by side.

compare.py FOLDER OUT.png [FILM.webp]
  FOLDER     has the folders bullet/ and lazyccd/, each with stats.json and the pictures that
             `lazyccd simulate --render` drew
  OUT.png    shows the last pictures side by side
  FILM.webp  shows all pictures side by side
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from PIL import Image

DETECTORS = [("bullet", "Bullet alone", "#c1272d"), ("lazyccd", "Bullet with LazyCCD", "#1b7a43")]
PIXELS_AN_INCH = 150
MS_A_FRAME, MS_AT_THE_END = 50, 1500


def main(folder, out):
    stats = {name: json.loads((folder / name / "stats.json").read_text()) for name, _, _ in DETECTORS}
    pictures = {name: plt.imread(max((folder / name).glob("*.png"))) for name, _, _ in DETECTORS}
    row = "{:<20} {:>6} {:>10} {:>14} {:>24} {:>10}"
    print(row.format("backend", "steps", "contacts", "pass-throughs", "intersections at the end", "ms a step"))
    height, width, _ = pictures["bullet"].shape
    caption = 0.16 * height
    figure, panels = plt.subplots(1, 2, figsize=(2 * width / PIXELS_AN_INCH,
                                                 (height + caption) / PIXELS_AN_INCH))
    for axes, (name, title, colour) in zip(panels, DETECTORS):
        s = stats[name]
        crossed = sum(s["pass_throughs"].values())
        # With Bullet alone, the only known contacts are those in its lists.
        contacts = sum(s["contacts"].values()) if name == "lazyccd" else s["contacts_in_bullets_lists"]
        print(row.format(title, s["steps"], contacts, crossed, s["intersections"],
                         f"{s['ms_per_step']['total']:.2f}"))
        axes.imshow(pictures[name])
        axes.axis("off")
        red = " (red)" if s["intersections"] else ""
        axes.text(0.5, 1.115, title, transform=axes.transAxes, ha="center", va="center",
                  fontsize=13, fontweight="bold", color=colour)
        axes.text(0.5, 1.04, f"{crossed} pass-throughs, {s['intersections']} intersections at the end{red}",
                  transform=axes.transAxes, ha="center", va="center", fontsize=11, color="#333333")
    figure.subplots_adjust(0, 0, 1, height / (height + caption), 0.004)
    figure.savefig(out, dpi=PIXELS_AN_INCH)


def film(folder, out):
    frames = []
    for left, right in zip(*(sorted((folder / name).glob("*.png")) for name, _, _ in DETECTORS)):
        halves = Image.open(left), Image.open(right)
        width, height = halves[0].size
        frames.append(Image.new("RGB", (2 * width + 4, height), "white"))
        frames[-1].paste(halves[0], (0, 0))
        frames[-1].paste(halves[1], (width + 4, 0))
    frames[0].save(out, save_all=True, append_images=frames[1:], loop=0, quality=75, method=4,
                   duration=[MS_A_FRAME] * (len(frames) - 1) + [MS_AT_THE_END])


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
    if len(sys.argv) > 3:
        film(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[3]))
