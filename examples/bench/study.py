"""Draws charts of the study from the CSV files that examples/bench/study.sh wrote.

study.py FOLDER reads the CSV files in FOLDER and writes there, as PNG:
  strategies   time of a step by strategy, one panel for each model
  stages       time of the traversal by strategy, one panel for each model; root-stages: from the root
  steps        time over the motion of the funnel, one line for each strategy (da Silva, figure 4.2)
  scaling      time by number of workers, one panel for each model
Charts whose CSV files are missing are left out.

"da Silva" is V. da Silva, "Lazy Work Stealing for Continuous Hierarchy Traversal on Deformable
Bodies", M.Sc. dissertation, COPPE/UFRJ.
"""
import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)

# Okabe and Ito's colours, which can be distinguished with any colour vision.
COLOURS = {
    "lazy_stealing": "#D55E00",
    "lazy_stealing_greedy": "#E69F00",
    "static_list": "#0072B2",
    "task_stealing": "#009E73",
    "guided": "#CC79A7",
    "thread_per_query": "#777777",
}


def read(folder, *names):
    rows = []
    for name in names:
        path = folder / f"{name}.csv"
        if path.exists():
            with open(path, newline="") as file:
                rows += list(csv.DictReader(file))
    return rows


def distinct(rows, column):
    return list(dict.fromkeys(row[column] for row in rows))


def style():
    plt.rcParams.update({
        "font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
        "grid.color": "#e4e4e4", "axes.axisbelow": True, "figure.dpi": 100,
    })


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(folder / f"{name}.png", dpi=150)
    plt.close(figure)


def panels(count):
    columns = min(count, 4)
    lines = -(-count // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(3.4 * columns, 2.7 * lines), squeeze=False)
    flat = [a for line in axes for a in line]
    for spare in flat[count:]:
        spare.set_axis_off()
    return figure, flat


def draw_strategies(rows, folder, column, label, name):
    models = distinct(rows, "model")
    figure, axes = panels(len(models))
    for model, a in zip(models, axes):
        chosen = [r for r in rows if r["model"] == model]
        names = [r["strategy"] for r in chosen]
        a.barh(names, [float(r[column]) for r in chosen], color=[COLOURS[n] for n in names])
        a.invert_yaxis()
        a.grid(axis="y", visible=False)
        a.set_title(model)
        a.set_xlabel(label)
    save(figure, folder, name)


def draw_steps(rows, folder, model="funnel"):
    rows = [r for r in rows if r["model"] == model]
    if not rows:
        return
    figure, a = plt.subplots(figsize=(8, 4))
    for strategy in distinct(rows, "strategy"):
        line = [r for r in rows if r["strategy"] == strategy]
        a.plot([int(r["step"]) for r in line], [float(r["ms_total"]) for r in line], label=strategy,
               color=COLOURS[strategy], linewidth=1.2)
    a.set_xlabel("step")
    a.set_ylabel("ms")
    a.set_ylim(bottom=0)
    a.set_title(f"Time over the motion: {model}")
    a.legend(frameon=False, ncols=2)
    save(figure, folder, "steps")


def draw_scaling(rows, folder):
    models = distinct(rows, "model")
    workers = "blocks" if rows[0]["backend"] == "cuda" else "threads"
    figure, axes = panels(len(models))
    for model, a in zip(models, axes):
        for strategy in distinct(rows, "strategy"):
            line = [r for r in rows if r["model"] == model and r["strategy"] == strategy and
                    r[workers] != "0"]
            a.plot([int(r[workers]) for r in line], [float(r["ms_total"]) for r in line], "o-",
                   label=strategy, color=COLOURS[strategy], markersize=4)
        a.set_xscale("log")
        ticks = sorted({int(r[workers]) for r in rows if r[workers] != "0"})
        a.set_xticks(ticks, [str(t) for t in ticks])
        a.set_xticks([], minor=True)
        a.set_ylim(bottom=0)
        a.set_title(model)
        a.set_xlabel(workers)
        a.set_ylabel("ms a step")
    axes[0].legend(frameon=False, fontsize=7)
    save(figure, folder, "scaling")


def main():
    folder = Path(sys.argv[1])
    style()
    strategies = read(folder, "strategies-small", "strategies-large")
    if strategies:
        draw_strategies(strategies, folder, "ms_total", "ms a step", "strategies")
    for name in ("stages", "root-stages"):
        stages = read(folder, name)
        if stages:
            draw_strategies(stages, folder, "ms_traverse", "ms of traversal", name)
    scaling = read(folder, "scaling")
    if scaling:
        draw_scaling(scaling, folder)
    draw_steps(read(folder, "steps"), folder)
    print("\n".join(str(path) for path in sorted(folder.glob("*.png"))))


if __name__ == "__main__":
    main()
