#!/usr/bin/env python3
"""Draws the folders of a source tree as layers, from the code's own includes.

draw_layers.py ROOT [FOLDER...] > layers.svg
  ROOT     include root of the tree, e.g. plugin or cuda
  FOLDER   folders below it to draw; default: all that hold sources

A folder stands above everything that it includes. Arrows that follow from others are left out. Fails if
folders include each other in a circle.
"""
import re
import sys
from pathlib import Path

SOURCES = {".h", ".cpp", ".cu", ".cuh"}
WIDTH, HEIGHT, GAP_X, GAP_Y = 150, 44, 26, 46


def read_tree(root, chosen):
    """Returns the modules of each folder and the folders that it includes."""
    files = [f for f in sorted(root.rglob("*")) if f.suffix in SOURCES]
    folder_of = {f: str(f.parent.relative_to(root)) for f in files}
    names = chosen or sorted(set(folder_of.values()) - {".", "include"})
    names = [n for n in names if not n.startswith("include")]

    def owner(folder):
        """The chosen folder that holds this one, or None."""
        fits = [n for n in names if folder == n or folder.startswith(n + "/")]
        return max(fits, key=len) if fits else None

    modules = {name: set() for name in names}
    below = {name: set() for name in names}
    for file in files:
        here = owner(folder_of[file])
        if here is None:
            continue
        modules[here].add(file.with_suffix(""))
        for include in re.findall(r'^\s*#\s*include\s+"([^"]+)"', file.read_text(), re.M):
            target = root / include
            there = owner(folder_of[target]) if target in folder_of else None
            if there is not None and there != here:
                below[here].add(there)
    return {name: len(m) for name, m in modules.items()}, below


def floors(below):
    """Returns the floor of each folder: 0 at the bottom, one more than the highest that it includes."""
    height, visiting = {}, []

    def visit(name):
        if name in visiting:
            sys.exit("circle: " + " -> ".join(visiting[visiting.index(name):] + [name]))
        if name not in height:
            visiting.append(name)
            height[name] = max((visit(n) + 1 for n in below[name]), default=0)
            visiting.pop()
        return height[name]

    for name in below:
        visit(name)
    return height


def reduce_arrows(below):
    """Leaves out every arrow that a longer way replaces."""
    def reaches(start, goal):
        return any(n == goal or reaches(n, goal) for n in below[start])

    return {name: {n for n in targets if not any(reaches(m, n) for m in targets - {n})}
            for name, targets in below.items()}


def plural(count, noun):
    return f"{count} {noun}" + ("" if count == 1 else "s")


def draw(root, counts, below):
    height = floors(below)
    sizes = {name: plural(count, "module") for name, count in counts.items()}
    rows = [sorted(n for n in height if height[n] == h) for h in range(max(height.values()), -1, -1)]
    widest = max(len(row) for row in rows)
    total = widest * (WIDTH + GAP_X) + GAP_X
    place = {}
    for y, row in enumerate(rows):
        start = (total - len(row) * (WIDTH + GAP_X) + GAP_X) / 2
        for x, name in enumerate(row):
            place[name] = (start + x * (WIDTH + GAP_X), 40 + y * (HEIGHT + GAP_Y))
    bottom = 40 + len(rows) * (HEIGHT + GAP_Y) - GAP_Y + 16
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total:.0f} {bottom:.0f}" '
             'font-family="sans-serif">',
             '<defs><marker id="a" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
             'orient="auto"><path d="M0 0L8 4L0 8z" fill="#8a8f98"/></marker></defs>',
             f'<rect width="{total:.0f}" height="{bottom:.0f}" fill="#ffffff"/>',
             f'<text x="{GAP_X}" y="24" font-size="15" fill="#22262c">{root.name}: each folder includes only '
             'what stands below it</text>']
    for name, targets in sorted(reduce_arrows(below).items()):
        x0, y0 = place[name]
        for target in sorted(targets):
            x1, y1 = place[target]
            ax, ay, bx, by = x0 + WIDTH / 2, y0 + HEIGHT, x1 + WIDTH / 2, y1 - 2
            middle = (by - ay) / 2
            lines.append(f'<path d="M{ax:.0f} {ay:.0f}C{ax:.0f} {ay + middle:.0f} {bx:.0f} '
                         f'{by - middle:.0f} {bx:.0f} {by:.0f}" fill="none" stroke="#b3b8c0" '
                         'stroke-width="1.3" marker-end="url(#a)"/>')
    for name, (x, y) in sorted(place.items()):
        lines.append(f'<rect x="{x:.0f}" y="{y:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="5" '
                     'fill="#e8eef7" stroke="#5b7db1"/>')
        lines.append(f'<text x="{x + WIDTH / 2:.0f}" y="{y + 19:.0f}" font-size="14" text-anchor="middle" '
                     f'fill="#22262c">{name}</text>')
        lines.append(f'<text x="{x + WIDTH / 2:.0f}" y="{y + 35:.0f}" font-size="11" text-anchor="middle" '
                     f'fill="#5c636e">{sizes[name]}</text>')
    return "\n".join(lines + ["</svg>"])


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    tree = Path(sys.argv[1])
    print(draw(tree, *read_tree(tree, sys.argv[2:])))
