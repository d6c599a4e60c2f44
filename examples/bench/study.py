"""Makes tables and charts of the study from the CSV files that examples/bench/study.sh wrote.

study.py FOLDER reads the CSV files in FOLDER and writes there tables.md and, as SVG and PNG:
  strategies   time of a step by strategy, one panel for each model
  stages       time of the traversal by strategy, one panel for each model; root-stages: from the root
  steps        time over the motion of the funnel, one line for each strategy (da Silva, figure 4.2)
  scaling      time by number of workers, one panel for each model
Tables and charts whose CSV files are missing are left out.

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
# Milliseconds a frame with lazy work stealing on a GTS 450, from da Silva. The models there are others of
# the same kind and size.
PUBLISHED_MS = {"funnel": "17.4", "cloth-ball": "77.3"}


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


def number(text):
    x = float(text)
    for size, letter in ((1e6, " M"), (1e3, " K")):
        if x >= size:
            return f"{x / size:.3g}{letter}"
    return f"{x:.3g}"


def markdown(title, heading, body):
    lines = [f"## {title}", "", "| " + " | ".join(heading) + " |", "|---" * len(heading) + "|"]
    lines += ["| " + " | ".join(cells) + " |" for cells in body]
    return "\n".join(lines) + "\n"


def strategies_table(rows, column, title):
    strategies = distinct(rows, "strategy")
    whole = column == "ms_total"  # the published times are of whole steps
    body = []
    for model in distinct(rows, "model"):
        times = {r["strategy"]: float(r[column]) for r in rows if r["model"] == model}
        best = min(times.values())
        triangles = next(r["triangles"] for r in rows if r["model"] == model)
        cells = [model, triangles] + [PUBLISHED_MS.get(model, "")] * whole
        for strategy in strategies:
            text = f"{times[strategy]:.3g}" if strategy in times else ""
            cells.append(f"**{text}**" if times.get(strategy) == best else text)
        body.append(cells)
    return markdown(title + " (mean; best in bold)",
                    ["model", "triangles"] + ["da Silva, GTS 450"] * whole + strategies, body)


def fronts_table(rows):
    rows = [r for r in rows if r["strategy"] == "lazy_stealing"]
    body = [[r["model"], r["triangles"], number(r["front_nodes"]), number(r["tree_tests"]),
             number(r["group_pairs"]), number(r["candidates"]), number(r["contacts"])] for r in rows]
    return markdown("Work a step (means)",
                    ["model", "triangles", "front", "tests of nodes", "pairs of groups", "candidates",
                     "contacts"], body)


def split_table(rows, title):
    columns = ["ms_total", "ms_refit", "ms_front", "ms_traverse", "ms_balance", "ms_leaf", "ms_narrow",
               "ms_sort"]
    body = []
    for r in rows:
        cells = [r["model"], r["strategy"]] + [f"{float(r[c]):.3g}" for c in columns]
        cells += [number(r["steals"]), number(r["balancings"]), f"{100 * float(r['idle_share']):.0f}",
                  f"{float(r['peak_bytes']) / 2**20:.1f}"]
        body.append(cells)
    return markdown(title, ["model", "strategy"] + [c[3:] for c in columns] +
                    ["steals", "balancings", "idle %", "MiB"], body)


def grid_table(rows, title, columns):
    times = [c for c in ("ms_total", "ms_device", "ms_refit", "ms_traverse", "ms_leaf", "ms_narrow")
             if any(float(r[c]) for r in rows)]
    heading = ["model"] + [c for c in columns] + [c[3:] for c in times] + [
        "group pairs", "candidates", "culled by volume", "culled by normal cone", "orphan tests", "never coplanar",
        "front before", "front after", "front reused", "steals", "idle %"]
    body = []
    for r in rows:
        body.append([r["model"]] + [r[c] for c in columns] +
                    [f"{float(r[c]):.3g}" for c in times] +
                    [number(r[c]) for c in ("group_pairs", "candidates", "culled_by_volume", "culled_by_normal_cone",
                                            "orphan_tests", "filtered_noncoplanar", "front_start",
                                            "front_nodes", "front_reused", "steals")] +
                    [f"{100 * float(r['idle_share']):.0f}"])
    return markdown(title, heading, body)


def style():
    plt.rcParams.update({
        "font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
        "grid.color": "#e4e4e4", "axes.axisbelow": True, "svg.fonttype": "path",
        "svg.hashsalt": "lazyccd", "figure.dpi": 100,
    })


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
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
    parts = []
    work = strategies or read(folder, "stages")
    cpu = bool(work) and work[0]["backend"] == "cpu"
    if work:
        where, workers = work[0]["device"], work[0]["threads"]
        parts += [f"# Study of balancing strategies: {where}" +
                  (f", {workers} threads" if cpu else "") + "\n", fronts_table(work)]
    if strategies:
        parts.append(strategies_table(strategies, "ms_total", "Milliseconds a step, by strategy"))
        draw_strategies(strategies, folder, "ms_total", "ms a step", "strategies")
        if cpu:
            parts.append(split_table(strategies, "Where the time goes, ms"))
    for name, title in (("stages", ""), ("root-stages", ", from the root")):
        stages = read(folder, name)
        if stages:
            parts.append(strategies_table(stages, "ms_traverse", "Traversal alone" + title + ", ms"))
            parts.append(split_table(
                stages, "Where the time goes, stage by stage without a graph" + title + ", ms"))
            draw_strategies(stages, folder, "ms_traverse", "ms of traversal", name)
    for names, title, columns in (
            (("root", "fronts"),
             "From the root or from the last front, remade by period and ratio",
             ["strategy", "front", "front_period", "front_ratio"]),
            (("scaling",), "Workers", ["strategy", "threads", "blocks"]),
            (("sizes",), "Sizes of stack, batch and block", ["strategy", "stack", "chunk", "block_size"]),
            (("stacks",), "Sizes of stack and batch, from the root", ["strategy", "stack", "chunk"]),
            (("chunks",), "Items that change hands at once", ["strategy", "chunk"]),
            (("volumes",), "Bounding volumes", ["front", "volume"]),
            (("culling",), "Culling", ["culling"])):
        rows = read(folder, *names)
        if rows:
            parts.append(grid_table(rows, title, columns))
    scaling = read(folder, "scaling")
    if scaling:
        draw_scaling(scaling, folder)
    draw_steps(read(folder, "steps"), folder)
    (folder / "tables.md").write_text("\n".join(parts))
    print(folder / "tables.md")


if __name__ == "__main__":
    main()
