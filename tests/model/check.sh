#!/usr/bin/env bash
# Searches every interleaving of the balancing protocols with Spin. Then searches each mutant, a
# protocol with one mistake, which must be caught. Takes about a minute. Exit code 77: Spin or a C
# compiler is not installed.
#
#   bash tests/model/check.sh
set -euo pipefail

models=$(cd "$(dirname "$0")" && pwd)
for tool in spin cc; do
  if ! command -v "$tool" >/dev/null; then
    echo "SKIPPED: $tool is not installed (Debian and Ubuntu: apt-get install spin gcc)"
    exit 77
  fi
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# search LEVEL MODEL OPTION...: runs the checker, optimized as by -O LEVEL, and leaves its report in
# pan.out. COLLAPSE stores states exactly, but in less memory.
search() {
  local level=$1 model=$2
  shift 2
  spin "$@" -a "$models/$model.pml" >spin.out || { cat spin.out; exit 1; }
  cc "-O$level" -w -DSAFETY -DCOLLAPSE -o pan pan.c
  ./pan -m100000 >pan.out 2>&1 || true
}

# report RESULT MODEL OPTIONS: prints one line about the last search.
report() {
  local states seconds
  states=$(sed -n 's/^ *\([0-9.e+]*\) states, stored.*/\1/p' pan.out)
  seconds=$(sed -n 's/^pan: elapsed time \([0-9.]*\) .*/\1/p' pan.out)
  printf '%-8s %-14s %10s states %7s s  %s\n' "$1" "$2" "$states" "$seconds" "$3"
}

# holds MODEL OPTION...: the search must be complete and find no error.
holds() {
  search 2 "$@"
  if grep -q 'errors: 0$' pan.out && ! grep -q -e 'not completed' -e 'too small' pan.out; then
    report holds "$1" "${*:2}"
  else
    report FAILED "$1" "${*:2}"
    cat pan.out
    exit 1
  fi
}

# caught MODEL OPTION...: the search must find the mistake of a mutant. Compiling takes longer.
caught() {
  search 0 "$@"
  if grep -q -e 'assertion violated' -e 'invalid end state (' pan.out; then
    report caught "$1" "${*:2}"
  else
    report MISSED "$1" "${*:2}"
    cat pan.out
    exit 1
  fi
}

holds lazy_stealing -DWORKERS=2 -DRING=1 -DCHUNKS=2 -DITEMS=5
holds lazy_stealing -DWORKERS=2 -DRING=2 -DCHUNKS=3 -DITEMS=5
holds lazy_stealing -DWORKERS=2 -DRING=2 -DCHUNKS=4 -DITEMS=4
holds lazy_stealing -DWORKERS=2 -DRING=2 -DCHUNKS=3 -DITEMS=5 -DINITIAL=2
holds lazy_stealing -DWORKERS=3 -DRING=2 -DCHUNKS=3 -DITEMS=3
for mutant in NO_TAG COUNT_AFTER_PUBLISHING CAS_OF_TOP_ALONE IDLE_BEFORE_LAST_PUSH POP_STORES \
  FREE_BEFORE_READ ROOM_UNCHECKED; do
  caught lazy_stealing "-D$mutant"
done

holds free_list -DWORKERS=2 -DIDS=3 -DROUNDS=2
holds free_list -DWORKERS=3 -DIDS=3 -DROUNDS=1
caught free_list -DNO_TAG

holds task_deque -DTHIEVES=1 -DTASKS=5 -DCAPACITY=3
holds task_deque -DTHIEVES=2 -DTASKS=4 -DCAPACITY=2
holds task_deque -DTHIEVES=1 -DTASKS=6 -DCAPACITY=4 -DMOST=2
holds task_deque -DTHIEVES=2 -DTASKS=4 -DCAPACITY=3 -DMOST=2
holds task_deque -DTHIEVES=1 -DTASKS=7 -DCAPACITY=5 -DMOST=3
for mutant in NO_TAG AGE_BEFORE_BOTTOM LAST_UNCHECKED; do
  caught task_deque "-D$mutant"
  caught task_deque "-D$mutant" -DMOST=2
done

holds greedy_stealing -DWORKERS=2 -DITEMS=5
holds greedy_stealing -DWORKERS=3 -DITEMS=3
for mutant in RELEASE_BEFORE_READ WON_DOES_NOT_COUNT; do
  caught greedy_stealing "-D$mutant" -DITEMS=3
done
