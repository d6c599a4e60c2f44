#!/usr/bin/env bash
# Counts the instructions of the float filter on ARM, with single numbers and in lanes. Every instruction is
# one line of qemu's log. Takes a few seconds.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
aarch64-linux-gnu-g++ -std=c++17 -O3 -ffp-contract=off -static -DLAZYCCD_ISA=baseline -I "$repository/cuda" \
  -I "$repository/cuda/include" "$repository/tests/install/cross/lanes.cpp" -o "$folder/lanes"

count() { qemu-aarch64-static -singlestep -d exec,nochain "$folder/lanes" "$@" 2>&1 >/dev/null | grep -c '^Trace'; }

queries=2048
for kind in one many; do
  hash=$(qemu-aarch64-static "$folder/lanes" $kind $queries)
  # What is not the filter is in both counts of a difference.
  instructions=$((($(count $kind $((2 * queries))) - $(count $kind $queries)) / queries))
  echo "$kind: $instructions instructions a query, hash $hash"
done
