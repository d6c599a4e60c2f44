#!/usr/bin/env bash
# What it costs to build given commits: processor seconds over those of one small unit.
#
#   bash tests/structure/build_cost.sh [--what example|tests|wheel]... COMMIT...
#
# Each commit is built in a fresh folder, without a compiler's cache, with the packages installed:
#   example  what examples/run.sh builds
#   tests    what tests/run.sh builds
#   wheel    the Python package; its own set-up of pip and Zig counts
# The unit, Eigen's SVD and std::regex at -O2, is compiled before and after each build, so numbers of machines and of
# busy hours can be compared. By default all three are built. The commits take turns.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
source "$repository/examples/setup.sh"

what=()
while [ "${1:-}" = --what ]; do
  what+=("$2")
  shift 2
done
[ ${#what[@]} -gt 0 ] || what=(example tests wheel)
[ $# -gt 0 ] || { sed -n '4p' "${BASH_SOURCE[0]}" >&2; exit 2; }
require_packages core bullet programs tests python

export CCACHE_DISABLE=1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/unit.cpp" <<'UNIT'
#include <Eigen/Dense>
#include <regex>
#include <string>

double largest_singular_value(const double* values, int size) {
  return Eigen::Map<const Eigen::MatrixXd>(values, size, size).jacobiSvd().singularValues()[0];
}

bool is_number(const std::string& text) {
  return std::regex_match(text, std::regex("[+-]?[0-9]+([.][0-9]*)?"));
}
UNIT

# processor_seconds COMMAND...: user and system time of the command and all that it starts
processor_seconds() {
  local TIMEFORMAT='%U %S' log=$work/log
  { time "$@" >"$log" 2>&1 || touch "$work/failed"; } 2>"$work/time"
  if [ -e "$work/failed" ]; then
    tail -n 20 "$log" >&2
    exit 1
  fi
  awk '{printf "%.2f", $1 + $2}' "$work/time"
}
reference() {
  processor_seconds g++ -std=c++17 -O2 -I/usr/include/eigen3 -c "$work/unit.cpp" -o "$work/unit.o"
}
# build WHAT FOLDER
build() {
  cd "$2"
  case $1 in
    example) cmake --preset cpu -DLAZYCCD_TESTS=OFF && cmake --build build/cpu -j "$jobs" --target lazyccd ;;
    tests) cmake --preset quick && cmake --build build/quick -j "$jobs" ;;
    wheel) bash plugin/python/build_wheel.sh ;;
    *) echo "$1: example, tests or wheel" >&2; return 2 ;;
  esac
}

printf '%-8s %-10s %12s %12s %8s\n' build commit 'processor s' 'one unit, s' units
for target in "${what[@]}"; do
  for commit in "$@"; do
    folder=$work/$commit
    git clone --quiet --no-checkout "$repository" "$folder"
    git -C "$folder" checkout --quiet "$(git -C "$repository" rev-parse "$commit")"
    before=$(reference)
    seconds=$(processor_seconds build "$target" "$folder")
    after=$(reference)
    awk -v build="$target" -v commit="$commit" -v seconds="$seconds" -v before="$before" -v after="$after" 'BEGIN {
      unit = (before + after) / 2
      printf "%-8s %-10s %12.0f %12.2f %8.1f\n", build, commit, seconds, unit, seconds / unit
    }'
    rm -rf "$folder"
  done
done
