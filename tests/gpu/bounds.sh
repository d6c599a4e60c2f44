#!/usr/bin/env bash
# Measures with hardware counters what limits each kernel of a step. Writes OUT/bounds.csv, one row
# per scene and kernel.
#
#   bash tests/gpu/bounds.sh FOLDER OUT     # FOLDER as for run.sh
set -eu
folder=$1 out=$2
stalls="long_scoreboard short_scoreboard no_instruction imc_miss wait math_pipe_throttle not_selected
  lg_throttle barrier branch_resolving membar"
metrics=gpu__time_duration.sum,smsp__inst_executed.sum
metrics+=,smsp__issue_active.avg.pct_of_peak_sustained_active,sm__warps_active.avg.per_cycle_active
metrics+=,smsp__thread_inst_executed_per_inst_executed.ratio,l1tex__t_sector_hit_rate.pct
metrics+=,lts__t_bytes.sum,dram__bytes.sum
metrics+=,l1tex__data_pipe_lsu_wavefronts.avg.pct_of_peak_sustained_elapsed
metrics+=,sm__inst_executed_pipe_alu.avg.pct_of_peak_sustained_active,launch__registers_per_thread
for stall in $stalls; do
  metrics+=,smsp__average_warps_issue_stalled_${stall}_per_issue_active.ratio
done
for start in "$folder"/*0.ply; do
  # Measures the last replays of the graph and the single launches after them, with the same
  # buffers.
  ncu --clock-control none --graph-profiling node --csv --metrics "$metrics" --launch-skip 60 \
    --launch-count 60 "$folder/lazyccd" bench "$start" "${start%0.ply}1.ply" --backend cuda \
    --strategy lazy_stealing --repeat 1 >"$out/bounds.$(basename "$start" .ply).csv" 2>"$out/ncu.log"
done
python3 - "$out" <<'PYTHON'
import csv, glob, os, re, statistics, sys

out = sys.argv[1]
columns = [
    ("us", "gpu__time_duration.sum", 1e-3),
    ("million_instructions", "smsp__inst_executed.sum", 1e-6),
    ("issue_percent", "smsp__issue_active.avg.pct_of_peak_sustained_active", 1),
    ("warps_a_multiprocessor", "sm__warps_active.avg.per_cycle_active", 1),
    ("lanes", "smsp__thread_inst_executed_per_inst_executed.ratio", 1),
    ("l1_hit_percent", "l1tex__t_sector_hit_rate.pct", 1),
    ("l1_wavefront_percent", "l1tex__data_pipe_lsu_wavefronts.avg.pct_of_peak_sustained_elapsed", 1),
    ("alu_percent", "sm__inst_executed_pipe_alu.avg.pct_of_peak_sustained_active", 1),
    ("l2_megabytes", "lts__t_bytes.sum", 1e-6),
    ("dram_megabytes", "dram__bytes.sum", 1e-6),
    ("registers", "launch__registers_per_thread", 1),
]
with open(os.path.join(out, "bounds.csv"), "w") as table:
    table.write("scene,kernel," + ",".join(c[0] for c in columns) + ",largest_stalls\n")
    for name in sorted(glob.glob(os.path.join(out, "bounds.*0.csv"))):
        lines = [line for line in open(name, errors="ignore") if line.startswith('"')]
        rows = list(csv.reader(lines))
        head = {key: i for i, key in enumerate(rows[0])}
        launches = {}
        for row in rows[1:]:
            if len(row) < len(head) or not row[0].isdigit():
                continue
            kernel = re.sub(r"<unnamed>::|\(anonymous namespace\)::", "", row[head["Kernel Name"]])
            kernel = re.sub(r"<.*|\(.*", "", kernel).split("::")[-1].split(" ")[-1]
            values = launches.setdefault((int(row[0]), kernel), {})
            values[row[head["Metric Name"]]] = float(row[head["Metric Value"]].replace(",", ""))
        for kernel in dict.fromkeys(k for _, k in sorted(launches)):
            # Only the faster half: leaves out traversals from the root and ones that ran out of
            # room.
            runs = sorted((v for (_, k), v in launches.items() if k == kernel),
                          key=lambda v: v["gpu__time_duration.sum"])
            runs = runs[:(len(runs) + 1) // 2]
            median = {m: statistics.median(r[m] for r in runs if m in r) for m in runs[0]}
            stalls = sorted(((v, re.sub(".*stalled_|_per_issue.*", "", m)) for m, v in median.items()
                             if "stalled" in m), reverse=True)[:3]
            table.write(f'{os.path.basename(name)[7:-5]},{kernel},')
            table.write(",".join(f"{median[m] * scale:.4g}" for _, m, scale in columns))
            table.write(',"' + " ".join(f"{stall}:{value:.1f}" for value, stall in stalls) + '"\n')
print(open(os.path.join(out, "bounds.csv")).read())
PYTHON
