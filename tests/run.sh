#!/usr/bin/env bash
# Sets up what is missing, builds, and runs all tests: the whole suite as released; under the address and
# undefined behaviour sanitizers the test programs but for the adapter in double precision, which has the same
# source as in single; the threaded parts below Bullet under the thread sanitizer. The CUDA backend is built where there is nvcc, and
# run where there is a device. Sanitized runs take one of many values that are alike, and a tenth of what is
# random. Warnings are errors.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../examples/setup.sh"

summary=()
passed=0 skipped=0
# run_tests PRESET [CTEST OPTION...]
run_tests() {
  local preset=$1 log=$repository/build/$1/ctest.log
  shift
  say "Testing $preset"
  local status=0
  (cd "$repository/build/$preset" && ctest -j "$jobs" --output-on-failure "$@") | tee "$log" || status=$?
  summary+=("$(printf '%-5s %s' "$preset" "$(grep -E '^[0-9]+% tests passed' "$log")")")
  passed=$((passed + $(grep -c ' Passed ' "$log" || true)))
  skipped=$((skipped + $(grep -c '\*\*\*Skipped ' "$log" || true)))
  return $status
}

require_packages core bullet programs tests
build_preset cpu -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON
run_tests cpu
build_preset asan -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON -- lazyccd_tests lazyccd_tests_threads \
  lazyccd_tests_bench lazyccd_tests_bullet lazyccd_tests_program
run_tests asan -L '^(core|threads|bench|bullet|program)$'
build_preset tsan -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON -- lazyccd_tests_threads
run_tests tsan -L threads

if command -v nvcc >/dev/null; then
  build_preset cuda -DLAZYCCD_WERROR=ON -DLAZYCCD_BULLET=OFF -DCMAKE_CUDA_ARCHITECTURES=90 -- \
    lazyccd_core check_traversal check_detector
  if nvidia-smi -L >/dev/null 2>&1; then
    run_tests cuda -L gpu
  else
    say "The CUDA backend is built and not run: there is no device"
  fi
else
  say "The CUDA backend is not built: there is no nvcc"
fi

say "All passed"
printf '%s\n' "${summary[@]}"
echo "$passed passed, 0 failed, $skipped skipped"
