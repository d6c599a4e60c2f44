#!/usr/bin/env bash
# Checks and times the CUDA backend on a machine with a GPU. It builds nothing: FOLDER holds the
# programs check_traversal, check_detector and lazyccd, linked with the static CUDA runtime, and may
# hold frame pairs *0.ply and *1.ply.
#
#   bash tests/gpu/run.sh FOLDER [OUT]     # tables and logs go to OUT (default: FOLDER/out)
set -u
folder=${1:?usage: run.sh FOLDER [OUT]}
out=${2:-$folder/out}
mkdir -p "$out"
failed=0
part() {  # NAME SECONDS COMMAND...
  local name=$1 seconds=$2 start=$SECONDS
  shift 2
  timeout "$seconds" "$@" >"$out/$name.log" 2>&1
  local rc=$?
  [ $rc -eq 0 ] || failed=1
  echo "== $name: exit $rc, $((SECONDS - start)) s"
  grep -v '^PASS' "$out/$name.log" | tail -n 40
}

nvidia-smi --query-gpu=name,driver_version --format=csv,noheader
frames=()
for start in "$folder"/*0.ply; do
  [ -e "$start" ] && frames+=("$start" "${start%0.ply}1.ply")
done
part traversal 90 "$folder/check_traversal"
part detector 150 "$folder/check_detector" --repeat "${REPEAT:-3}" "${frames[@]}"
part bench 120 "$folder/lazyccd" bench "${frames[@]}" --repeat 30 --csv "$out/bench.csv" \
  --label "$(git rev-parse --short HEAD 2>/dev/null)"
if [ -n "${SANITIZE:-}" ]; then
  for tool in memcheck racecheck initcheck synccheck; do
    part "sanitizer-$tool" 60 compute-sanitizer --tool $tool "$folder/check_detector" --small
  done
fi
exit $failed
