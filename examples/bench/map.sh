#!/usr/bin/env bash
# Where collisions fail: scenes over speed, time step, thickness and triangle size, with Bullet alone and
# with LazyCCD, in both worlds and precisions. A table, a CSV file and a picture (SVG and PNG) in
# examples/results/map; with --quick a small one in build/map_quick, in a minute. Goes on where it was stopped;
# --fresh begins anew. Further options go to map.py.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

out=$repository/examples/results/map
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
