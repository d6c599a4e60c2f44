#!/usr/bin/env bash
# Makes a map of where collisions fail: scenes over speed, time step, thickness and triangle size, with
# Bullet alone and with LazyCCD, in both worlds and precisions. Prints a table and writes a CSV file and a
# picture to examples/results/failures. With --quick it writes a small map to build/map_quick, in
# a minute. It continues a run that was stopped; --fresh starts again. Other options go to map.py.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

out=$repository/examples/results/failures
options=()
fresh=no
for option in "$@"; do
  case $option in
    --quick) out=$repository/build/map_quick options+=(--quick) ;;
    --fresh) fresh=yes ;;
    *) options+=("$option") ;;
  esac
done

require_packages core bullet programs pictures
build_preset cpu -- lazyccd lazyccd_double
[ $fresh = yes ] && rm -f "$out/map.csv"
say "The map"
/usr/bin/python3 "$repository/examples/bench/map.py" "$repository/build/cpu/examples" "$out" --jobs "$jobs" "${options[@]}"
