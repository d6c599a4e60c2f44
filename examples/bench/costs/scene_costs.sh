#!/usr/bin/env bash
# Measures the time of a step in common scenes, with Bullet alone and with LazyCCD, in both worlds and
# precisions, and the time of solving the links of a cloth. Prints tables and writes CSV files to
# build/scene_costs. Options go to lazyccd_scene_costs, e.g. --only capsule, --cpu-time.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../setup.sh"

require_packages core bullet programs
build_preset cpu -- lazyccd_scene_costs lazyccd_scene_costs_double lazyccd_link_costs lazyccd_link_costs_double
bench=$repository/build/cpu/examples/bench
out=$repository/build/scene_costs
mkdir -p "$out"
for suffix in "" _double; do
  say "Whole steps$suffix"
  "$bench/lazyccd_scene_costs$suffix" --csv "$out/costs$suffix.csv" "$@"
  say "Links of a cloth$suffix"
  "$bench/lazyccd_link_costs$suffix"
done
