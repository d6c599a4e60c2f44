#!/usr/bin/env bash
# The main example: two cloths fall on a ball and a table, with LazyCCD and with Bullet alone. Installs
# missing packages, builds, runs the scene with both, prints a table and draws both end states.
#
#   bash examples/run.sh [--world deformable|rigid] [--steps N] [--film]
#
# --film also draws every sixth step and makes a film of both side by side. That takes minutes.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

options=()
pictures=(--every 1000000 --width 900 --samples 64)
film=()
while [ $# -gt 0 ]; do
  case $1 in
    --world | --steps)
      [ $# -ge 2 ] || { echo "$1 needs a value" >&2; exit 2; }
      options+=("$1" "$2")
      shift 2
      ;;
    --film)
      pictures=(--every 6 --width 480 --samples 16)
      film=("$repository/build/drop/film.webp")
      shift
      ;;
    *)
      sed -n '2,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
      exit 2
      ;;
  esac
done

require_packages core bullet programs pictures
build_preset cpu -DLAZYCCD_TESTS=OFF -- lazyccd

program=$repository/build/cpu/examples/lazyccd
results=$repository/build/drop
progress=()
[ -t 2 ] && progress=(--progress)  # on a terminal only; a log would get a line a step
for detector in lazyccd bullet; do
  say "Scene drop, $([ $detector = lazyccd ] && echo 'Bullet with LazyCCD' || echo 'Bullet alone')"
  rm -rf "${results:?}/$detector"
  mkdir -p "$results/$detector"
  "$program" simulate drop --detector $detector "${options[@]}" "${progress[@]}" \
    --render "$results/$detector" "${pictures[@]}" --stats "$results/$detector/stats.json" >"$results/$detector/log"
done

say "Result"
# The packaged matplotlib works only with Debian's own python3, which may not be first in the path.
python=/usr/bin/python3
[ -x $python ] || python=python3
$python "$repository/examples/cli/film/compare.py" "$results" "$results/drop.png" "${film[@]}"
echo
echo "Picture of both end states: ${results#"$PWD"/}/drop.png"
[ ${#film[@]} -eq 0 ] || echo "Film: ${film[0]#"$PWD"/}"
