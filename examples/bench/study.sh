#!/usr/bin/env bash
# Runs the study of balancing strategies: the generated models through their motion, with every strategy,
# number of workers, buffer size, bounding volume and culling. Writes CSV files and charts.
#
#   bash examples/bench/study.sh [--backend cpu|cuda] [--out FOLDER] [--quick] [--program FILE | --draw]
#
# --out: the folder of results, by default out/study-BACKEND. --quick: few steps, as a test of the script.
# --program: measures with a program that is already built and installs nothing. --draw: measures
# nothing; makes charts from the CSV files in the folder.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
backend=cpu out='' program='' quick='' draw=''
while [ $# -gt 0 ]; do
  case $1 in
    --backend) backend=$2; shift ;;
    --out) out=$2; shift ;;
    --program) program=$2; shift ;;
    --quick) quick=yes ;;
    --draw) draw=yes ;;
    *) sed -n '5,9s/^# \?//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
  esac
  shift
done
case $backend in cpu | cuda) ;; *) echo "there is no backend '$backend'" >&2; exit 2 ;; esac
out=${out:-$here/../../out/study-$backend}
mkdir -p "$out"

if [ -z "$program$draw" ]; then
  source "$here/../setup.sh"
  require_packages core programs pictures
  build_preset "$backend" -DLAZYCCD_BULLET=OFF -DLAZYCCD_TESTS=OFF -- lazyccd
  program=$repository/build/$backend/examples/lazyccd
fi

small=(cloud-64 cloud-256 cloud-1024 funnel)
large=(cloud-4096 cloth-ball n-body)
some=(--first 44 --last 60)  # part of the motion, for comparisons of sizes
window=()                    # part of the motion for large models; empty: all of it
[ "$backend" = cpu ] && window=("${some[@]}")
whole=()
if [ -n "$quick" ]; then some=(--first 50 --last 53) window=("${some[@]}") whole=(--first 50 --last 54); fi
workers=(--threads) && for ((n = 1; n < $(nproc); n *= 2)); do workers+=("$n"); done
workers+=("$(nproc)")
[ "$backend" = cuda ] && workers=(--blocks 1 4 16 66 132 0)

# study NAME OPTION...: runs one part of the study and writes NAME.csv
study() {
  local name=$1
  shift
  printf '\n== %s\n' "$name"
  "$program" study --backend "$backend" --csv "$out/$name.csv" "$@"
}

measure() {
  study strategies-small "${whole[@]}" --model "${small[@]}" --steps-csv "$out/steps.csv"
  study strategies-large "${window[@]}" --model "${large[@]}"
  study root "${window[@]}" --model funnel cloth-ball n-body --front off
  study fronts "${window[@]}" --model cloud-1024 funnel cloth-ball n-body --strategy lazy_stealing \
    --front on --front-period 2 10 --front-ratio 1 1.02 1.1
  study scaling "${some[@]}" --model funnel cloud-1024 n-body "${workers[@]}"
  if [ "$backend" = cpu ]; then
    study sizes "${some[@]}" --model funnel --strategy lazy_stealing_greedy \
      --stack 4 8 16 32 64 --chunk 2 4 8 16
    study chunks "${some[@]}" --model funnel --strategy lazy_stealing --chunk 1 4 16 64 256
  else
    study stages "${window[@]}" --model "${small[@]}" "${large[@]}" --stages
    study root-stages "${window[@]}" --model funnel cloth-ball n-body --front off --stages
    study sizes "${some[@]}" --model funnel cloth-ball --strategy lazy_stealing --stages \
      --block-size 32 64 128 256 512 --chunk 32 128 256
    study stacks "${some[@]}" --model funnel cloth-ball --front off --stages --stack 256 512 1024 \
      --chunk 32 128 256 --strategy lazy_stealing lazy_stealing_greedy
  fi
  local culling=(--model funnel cloth-ball n-body --strategy lazy_stealing)
  local volumes=("${culling[@]}")
  if [ "$backend" = cuda ]; then
    culling=(--model "${small[@]}" "${large[@]}" --stages --strategy lazy_stealing)
    volumes=("${culling[@]}" --front auto off)
  fi
  study volumes "${some[@]}" "${volumes[@]}" --volume box dop18 oriented_box
  study culling "${some[@]}" "${culling[@]}" --culling none non_penetration normal_cones orphan_sets \
    non_penetration+normal_cones+orphan_sets
}

[ -n "$draw" ] || measure
if /usr/bin/python3 -c 'import matplotlib' 2>/dev/null; then
  /usr/bin/python3 "$here/study.py" "$out"
elif [ -n "$draw" ]; then
  echo 'python3-matplotlib is missing' >&2
  exit 1
fi
