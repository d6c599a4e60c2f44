#!/usr/bin/env bash
# Checks and times the CUDA backend on a machine with a GPU. It builds nothing: FOLDER holds the
# programs check_traversal, check_detector and lazyccd (and lazyccd_double), linked with the static CUDA
# runtime, and may hold frame pairs *0.ply and *1.ply and, in lib/, Bullet's shared libraries.
#
#   bash tests/gpu/run.sh FOLDER [OUT]     # tables and logs go to OUT (default: FOLDER/out)
set -u
folder=${1:?usage: run.sh FOLDER [OUT]}
out=${2:-$folder/out}
mkdir -p "$out"
export LD_LIBRARY_PATH=$folder/lib:${LD_LIBRARY_PATH:-}
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
# Scenes in Bullet, where the programs are built with it: the thrown cloth stays on its side.
scenes() {
  local bad=0 program scene world options
  for program in "$folder"/lazyccd "$folder"/lazyccd_double; do
    [ -x "$program" ] && "$program" scenes >/dev/null 2>&1 || continue
    for world in rigid deformable; do
      while read -r scene options; do
        # shellcheck disable=SC2086
        "$program" simulate $scene $options --world $world --backend cuda >"$out/scene.log" 2>&1
        grep -q 'pass-throughs: 0 vertex-face, 0 edge-edge' "$out/scene.log" &&
          grep -q 'LazyCCD: cuda' "$out/scene.log" || bad=1
        echo "$(basename "$program") $scene $options $world: $(grep -hE 'steps,|pass-through|failed|lazyccd:' "$out/scene.log" | paste -sd' ')"
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
export folder out
part scenes 240 bash -c scenes
if [ -n "${SANITIZE:-}" ]; then
  for tool in memcheck racecheck initcheck synccheck; do
    part "sanitizer-$tool" 60 compute-sanitizer --tool $tool "$folder/check_detector" --small
  done
fi
exit $failed
