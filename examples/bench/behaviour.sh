#!/usr/bin/env bash
# Runs the behaviour scenes with Bullet alone and with LazyCCD. Prints tables and writes them as CSV files,
# with pictures, to examples/results/behaviour. Options go to lazyccd_behaviour, e.g.
# --only grip; then everything goes to build/behaviour. --no-curve leaves out the second chart.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

out=$repository/examples/results/behaviour
options=()
curve=yes
for option in "$@"; do
  case $option in
    --no-curve) curve=no ;;
    *) options+=("$option") ;;
  esac
done
[ ${#options[@]} -gt 0 ] && out=$repository/build/behaviour

require_packages core bullet programs pictures
build_preset cpu -- lazyccd_behaviour lazyccd_behaviour_double
bench=$repository/build/cpu/examples/bench
mkdir -p "$out"
for suffix in "" _double; do
  say "Figures$suffix"
  "$bench/lazyccd_behaviour$suffix" --csv "$out/behaviour$suffix.csv" "${options[@]}"
done
if [ $curve = yes ]; then
  say "Cost against pass-throughs"
  "$bench/lazyccd_behaviour" --curve --csv "$out/curve.csv" "${options[@]}"
fi
say "Pictures"
/usr/bin/python3 "$repository/examples/bench/behaviour.py" "$out"
