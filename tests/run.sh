#!/usr/bin/env bash
# Sets up what is missing, builds, and runs all tests: the whole suite as released and under the address
# and undefined behaviour sanitizers, the threaded parts under the thread sanitizer. Warnings are errors.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../examples/setup.sh"

summary=()
# run_tests PRESET [CTEST OPTION...]
run_tests() {
  local preset=$1 log=$repository/build/$1/ctest.log
  shift
  say "Testing $preset"
  local status=0
  (cd "$repository/build/$preset" && ctest -j "$jobs" --output-on-failure "$@") | tee "$log" || status=$?
  summary+=("$(printf '%-5s %s' "$preset" "$(grep -E '^[0-9]+% tests passed' "$log")")")
  return $status
}

require_packages core bullet programs tests
build_preset cpu -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON
run_tests cpu
build_preset asan -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON
run_tests asan
build_preset tsan -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON -- lazyccd_tests_stability
run_tests tsan -L stability

say "All passed"
printf '%s\n' "${summary[@]}"
