#!/usr/bin/env bash
# Runs all checks and timings of the CUDA backend on a machine with a GPU. It builds nothing. FOLDER
# holds the programs check_traversal, check_topology, check_hierarchy, check_worlds, check_device,
# check_host, check_detector, check_scenes and lazyccd (and lazyccd_double), linked with the static
# CUDA runtime. It may hold frame pairs *0.ply and *1.ply and, in lib/, Bullet's shared libraries.
#
#   bash tests/gpu/run.sh FOLDER [OUT]     # tables and logs go to OUT (default: FOLDER/out)
#
# REPEAT=100   repetitions of each frame       SANITIZE=1  with compute-sanitizer, small scenes
# STEPS=200    of each scene of the library    PARTS="traversal detector ..."  only these
set -u
folder=$(cd "${1:?usage: run.sh FOLDER [OUT]}" && pwd)
out=${2:-$folder/out}
mkdir -p "$out"
here=$(cd "$(dirname "$0")" && pwd)
export LD_LIBRARY_PATH=$folder/lib:${LD_LIBRARY_PATH:-} here folder out
failed=0
part() {  # NAME SECONDS COMMAND...
  local name=$1 seconds=$2 start=$SECONDS
  shift 2
  [[ " ${PARTS:-$name} " == *" $name "* ]] || return 0
  timeout "$seconds" "$@" >"$out/$name.log" 2>&1
  local rc=$?
  [ $rc -eq 0 ] || failed=1
  echo "== $name: exit $rc, $((SECONDS - start)) s, $(grep -c '^PASS' "$out/$name.log") passed"
  grep -v '^PASS' "$out/$name.log" | tail -n 40
}

nvidia-smi --query-gpu=name,driver_version --format=csv,noheader
frames=()
for start in "$folder"/*0.ply; do
  [ -e "$start" ] && frames+=("$start" "${start%0.ply}1.ply")
done

part traversal 120 "$folder/check_traversal"
part topology 200 "$folder/check_topology" --large
part hierarchy 300 "$folder/check_hierarchy" --large
part worlds 200 "$folder/check_worlds"
part device 200 "$folder/check_device"
part host 200 "$folder/check_host"
part detector 300 "$folder/check_detector" --repeat "${REPEAT:-3}" "${frames[@]}"

# Checks every scene of the library: both backends find the same contacts in each step. Runs several
# scenes at the same time.
library() {
  "$folder/check_scenes" --list |
    xargs -P "$(nproc)" -I{} bash -c '"$0" --steps "$1" "$2" >"$3/library.$2.log" 2>&1 || touch "$3/library.failed"' \
      "$folder/check_scenes" "${STEPS:-200}" {} "$out"
  cat "$out"/library.*.log
  [ ! -e "$out/library.failed" ]
}
export -f library
rm -f "$out"/library.*
[ -x "$folder/check_scenes" ] && part library 300 bash -c library

# Steps scenes in which nothing may pass through, with the CUDA backend.
scenes() {
  local bad=0 program world scene options
  for program in "$folder"/lazyccd "$folder"/lazyccd_double; do
    [ -x "$program" ] || continue
    "$program" scenes >/dev/null || return 1
    for world in rigid deformable; do
      while read -r scene options; do
        # shellcheck disable=SC2086
        "$program" simulate $scene $options --world $world --backend cuda >"$out/scene.log" 2>&1
        grep -q 'pass-throughs: 0 vertex-face, 0 edge-edge' "$out/scene.log" &&
          grep -q 'LazyCCD: cuda' "$out/scene.log" || bad=1
        echo "$(basename "$program") $scene $options $world:" \
          "$(grep -hE 'steps,|pass-through|failed|lazyccd:' "$out/scene.log" | paste -sd' ')"
      done <<'LIST'
cloth-on-cloth --speed 2 --dt 0.0166667
cloth-on-cloth --speed 10 --dt 0.0166667
cloth-on-cloth --speed 30 --dt 0.0166667
cloth-on-cloth --speed 30 --dt 0.00416667
small-triangles --dt 0.00416667
edge-on-edge --speed 1
edge-on-edge --speed 5 --margin 0.1
LIST
    done
  done
  return $bad
}
export -f scenes
part scenes 240 bash -c scenes
if [ -n "${SANITIZE:-}" ]; then
  for tool in memcheck racecheck initcheck synccheck; do
    part "sanitizer-$tool" 120 compute-sanitizer --tool $tool "$folder/check_detector" --small
    part "sanitizer-device-$tool" 200 compute-sanitizer --tool $tool "$folder/check_device" --small
    part "sanitizer-host-$tool" 120 compute-sanitizer --tool $tool "$folder/check_host" --small
    part "sanitizer-topology-$tool" 120 compute-sanitizer --tool $tool "$folder/check_topology" --small
    part "sanitizer-hierarchy-$tool" 120 compute-sanitizer --tool $tool "$folder/check_hierarchy" --small
  done
fi

part bench 120 "$folder/lazyccd" bench "${frames[@]}" --repeat 30 --csv "$out/bench.csv" \
  --label "$(git -C "$here" rev-parse --short HEAD 2>/dev/null)"
# Times a Bullet step of the size of Cloth/Ball; medians. Besides the kernels there are `gather`,
# `write` and the part of a detection beyond the device's time. The first step also builds lasting
# data.
step() {
  "$folder/lazyccd" simulate cloth-on-cloth --world deformable --size 5.77 --speed 0.1 --steps 40 \
    --backend cuda --stats "$out/step.json" || return
  python3 - "$out/step.json" <<'PYTHON'
import json, sys

times = json.load(open(sys.argv[1]))["median_ms_per_step"]
print("ms a step:", ", ".join(f"{part} {ms:.3f}" for part, ms in times.items()))
PYTHON
}
export -f step
part step 120 bash -c step
# Times whole steps of the README's scene; means: with the CUDA backend, the CPU backend, Bullet
# alone.
drop() {
  local size with
  for size in 1 2; do
    for with in "--backend cuda" "--backend cpu" "--detector bullet"; do
      # shellcheck disable=SC2086
      "$folder/lazyccd" simulate drop --size $size --steps 120 $with --stats "$out/drop.json" \
        >/dev/null || return
      python3 - "$out/drop.json" "size $size $with" <<'PYTHON'
import json, sys

run = json.load(open(sys.argv[1]))
parts = ", ".join(f"{part} {ms:.2f}" for part, ms in run["ms_per_step"].items())
passed = sum(run["pass_throughs"].values())
print(f"drop {sys.argv[2]}: {parts} ms; {passed} pass-throughs")
PYTHON
    done
  done
}
export -f drop
part drop 200 bash -c drop
if command -v ncu >/dev/null && command -v python3 >/dev/null; then
  part bounds 120 bash "$here/bounds.sh" "$folder" "$out"
fi
exit $failed
