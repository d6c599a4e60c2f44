#!/usr/bin/env bash
# Measures speed and accuracy of elementary tests and of whole steps. Prints two tables and writes two CSV
# files and pictures to examples/results/accuracy. Options go to lazyccd_chart, e.g. --rounds 9.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../setup.sh"

require_packages core bullet programs tests pictures
build_preset cpu -DLAZYCCD_TESTS=ON -- lazyccd_chart lazyccd_bench
bench=$repository/build/cpu/examples/bench
out=$repository/examples/results/accuracy
mkdir -p "$out"

say "Elementary tests"
"$bench/lazyccd_chart" --csv "$out/queries.csv" "$@"
say "Whole steps"
"$bench/lazyccd_bench" --csv "$out/steps.csv"
say "Pictures"
/usr/bin/python3 "$repository/examples/bench/accuracy/chart.py" "$out"
