"""Table and picture of the main job: the scene `drop` with LazyCCD and with Bullet alone.

compare.py FOLDER OUT.png: FOLDER holds lazyccd/ and bullet/, each with stats.json and PLY frames.
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import render

BACKENDS = [("lazyccd", "Bullet with LazyCCD"), ("bullet", "Bullet alone")]
# Two sides of each cloth.
CLOTHS = [[(0.95, 0.62, 0.22), (0.80, 0.45, 0.15)], [(0.35, 0.60, 0.92), (0.22, 0.42, 0.75)]]
PIERCING = (0.85, 0.0, 0.1)


def draw(frame, piercings, size):
    vertices, faces = render.read_ply(frame)
    camera = render.Camera((1.6, 1.55, 2.0), (0, 0.19, 0), size, size * 5 // 8, 0.46)
    picture = render.Picture(camera)
    # The rigid bodies of examples/scenes/piles.cpp.
    picture.draw(*render.box((-0.8, -0.1, -0.8), (0.8, 0, 0.8)), (0.78, 0.76, 0.74), front_only=True)
    picture.draw(*render.sphere((0, 0.3, 0), 0.3), (0.6, 0.62, 0.66), front_only=True)
    part = render.components(len(vertices), faces)
    for i, colour in enumerate(CLOTHS):
        picture.draw(vertices, faces[part[faces[:, 0]] == i], colour)
    picture.mark(piercings, PIERCING, radius=size / 220, slack=0.02)
    return picture.reduced(2)


def main(folder, out):
    stats = {name: json.loads((folder / name / "stats.json").read_text()) for name, _ in BACKENDS}
    row = "{:<20} {:>6} {:>10} {:>14} {:>18} {:>10}"
    print(row.format("backend", "steps", "contacts", "pass-throughs", "piercings at rest", "ms a step"))
    figure, axes = plt.subplots(1, len(BACKENDS), figsize=(11, 4.1))
    for axis, (name, title) in zip(axes, BACKENDS):
        s = stats[name]
        crossed = sum(s["pass_throughs"].values())
        # Bullet alone knows only the contacts in its lists.
        contacts = sum(s["contacts"].values()) if name == "lazyccd" else s["contacts_in_bullets_lists"]
        print(row.format(title, s["steps"], contacts, crossed, s["piercings"],
                         f"{s['ms_per_step']['total']:.2f}"))
        last = max((folder / name).glob("*.ply"))
        axis.imshow(draw(last, s["piercing_points"], 1400), interpolation="antialiased")
        red = " (red)" if s["piercings"] else ""
        axis.set_title(f"{title}\n{crossed} pass-throughs, {s['piercings']} piercings at rest{red}",
                       fontsize=11)
        axis.axis("off")
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.87, 0.02)
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
