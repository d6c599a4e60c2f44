#!/usr/bin/env bash
# Measures result pages again: runs their benches, notes machine and commit in examples/results/runs.csv, and
# writes the tables into the pages. Run it on an idle machine.
#
#   bash examples/bench/all.sh PAGE...
#
# page        takes       needs
# accuracy    minutes     frames of LAZYCCD_DATA_DIR for whole detections (default: shared/data)
# failures    hours
# behaviour   40 minutes
# costs       1.5 hours   as many cores as the table of threads is to have; 16 in the recorded one
# gpu         30 minutes  an NVIDIA GPU, nvcc and the frames
# strategies  5 minutes   an NVIDIA GPU and nvcc
# users       half an hour; demos and tasks of other projects stay as they are
#
# Without a page it prints this list. examples/bench/pages.py writes the tables without measuring.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source "$here/../setup.sh"
cd "$repository"
results=examples/results
programs=build/cpu/examples
bench=$programs/bench
work=build/all
commands=()

# Runs a command. `note FILE...` then says that the commands since the last note wrote these files.
run() {
  say "$*" >&2
  commands+=("$*")
  "$@"
}
note() {
  local joined
  joined=$(printf '%s; ' "${commands[@]}")
  python3 "$here/pages.py" --ran "$@" -- "${joined%; }"
  commands=()
}
# Prints the rows of the Markdown table in a file as CSV, without its heading.
cells() { grep '^|' "$1" | tail -n +3 | sed 's/^| *//; s/ *|$//; s/ *| */,/g'; }
# Prints CSV files that have the same heading as one.
joined() { head -n 1 "$1" && tail -q -n +2 "$@"; }

accuracy() { run bash examples/bench/accuracy/chart.sh && note accuracy/queries.csv accuracy/steps.csv; }

failures() { run bash examples/bench/map.sh --fresh && note failures/map.csv; }

behaviour() {
  run bash examples/bench/behaviour.sh
  note behaviour/behaviour.csv behaviour/behaviour_double.csv behaviour/curve.csv
  build_preset cpu -- lazyccd lazyccd_double
  run /usr/bin/python3 examples/bench/no_regression.py $programs --rounds 0 --csv $results/behaviour/paths.csv
  note behaviour/paths.csv
}

strategies() {
  run bash examples/bench/study.sh --backend cuda --out $results/strategies
  note $(cd $results && echo strategies/*.csv)
}

users() {
  require_packages core python
  python3 -m venv $work/simulators
  $work/simulators/bin/pip install --quiet ./plugin/python -r examples/bench/simulators/requirements.txt
  run $work/simulators/bin/python examples/bench/simulators/compare.py --limit 25 --csv $results/simulators.csv
  note simulators.csv
}

costs() { source "$here/costs/all.sh"; }
gpu() { source "$here/device/all.sh"; }

pages="accuracy failures behaviour costs gpu strategies users"
if [ $# -eq 0 ]; then
  sed -n '5,16s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit
fi
for page in "$@"; do
  [[ " $pages " == *" $page "* ]] || { echo "there is no page $page; there are $pages" >&2; exit 2; }
done
mkdir -p $work
for page in "$@"; do
  $page
  python3 "$here/pages.py" "$page"
done
