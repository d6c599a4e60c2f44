#!/usr/bin/env bash
# Sets up what is missing, builds, and runs the tests.
#
#   bash tests/run.sh          one configuration: release build, Bullet in single precision; random
#                              tests run a quarter of their repetitions
#   bash tests/run.sh --ci     what CI checks
#   bash tests/run.sh --all    that, and what takes longer
#
# --ci: GCC, with Bullet in single precision; the layers of the includes; the model checker; the installed
# package; Bullet in the layouts of package managers; the Python package; Clang with the address and undefined
# behaviour sanitizers, with Bullet in double precision; the thread sanitizer; the CUDA backend, built if there
# is nvcc and run if there is a device. Warnings are errors. Sanitized runs take one of many values that are
# alike, and a tenth of the random ones.
# --all: also both precisions in both of them, every header compiled alone, and the program with sanitizers.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../examples/setup.sh"

case ${1:-} in
  '' | --ci | --all) amount=${1:---quick} ;;
  *) sed -n '4,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac

summary=()
passed=0 skipped=0
# run_tests PRESET [CTEST OPTION...]
run_tests() {
  local preset=$1 log=$repository/build/$1/ctest.log start=$SECONDS
  shift
  say "Testing $preset"
  local status=0
  (cd "$repository/build/$preset" && ctest -j "$jobs" --output-on-failure "$@") | tee "$log" || status=$?
  summary+=("$(printf '%-6s %s, %s s' "$preset" "$(grep -E '^[0-9]+% tests passed' "$log")" $((SECONDS - start)))")
  passed=$((passed + $(grep -c ' Passed ' "$log" || true)))
  skipped=$((skipped + $(grep -c '\*\*\*Skipped ' "$log" || true)))
  return $status
}

# The Python package, with the detector of build/cpu. Where Python is missing, a line says so.
run_python_tests() {
  local start=$SECONDS status=0
  bash "$repository/tests/python/run.sh" || status=$?
  case $status in
    0) summary+=("python tested in $((SECONDS - start)) s") ;;
    77) summary+=("python not tested") ;;
    *) return $status ;;
  esac
}

# Finds Bullet where package managers put it.
run_layout_tests() {
  local start=$SECONDS
  say "Finding Bullet in the layouts of package managers"
  bash "$repository/tests/install/bullet.sh" --layouts
  summary+=("Bullet found in 6 layouts in $((SECONDS - start)) s")
}

build() {
  local start=$SECONDS
  build_preset "$@"
  summary+=("$(printf '%-6s built in %s s' "$1" $((SECONDS - start)))")
}

require_packages core bullet programs tests
if [ "$amount" = --quick ]; then
  build quick
  export LAZYCCD_QUICK_TESTS=1
  run_tests quick -LE '^(model|consumer)$'
else
  require_packages checks python
  headers=OFF precisions=float sanitized_precisions=double
  sanitized=(lazyccd_tests lazyccd_tests_threads lazyccd_tests_bullet_double) labels='core|threads|bullet_double'
  if [ "$amount" = --all ]; then
    headers=ON precisions='float;double' sanitized_precisions=$precisions
    sanitized+=(lazyccd_tests_bullet lazyccd_tests_program) labels+='|bullet|program'
  fi
  build cpu -DLAZYCCD_TESTS=ON -DLAZYCCD_ASSERTIONS=ON -DLAZYCCD_WERROR=ON -DLAZYCCD_CHECK_HEADERS=$headers -DLAZYCCD_PRECISIONS="$precisions"
  run_tests cpu
  run_python_tests
  run_layout_tests
  build asan -DLAZYCCD_PRECISIONS="$sanitized_precisions" -- "${sanitized[@]}"
  run_tests asan -L "^($labels)$"
  build tsan -- lazyccd_tests_threads
  run_tests tsan -L threads
  if command -v nvcc >/dev/null; then
    build cuda -DLAZYCCD_ASSERTIONS=ON -DLAZYCCD_WERROR=ON -DLAZYCCD_BULLET=OFF -DCMAKE_CUDA_ARCHITECTURES=90 -- \
      lazyccd_core check_traversal check_hierarchy check_detector
    if nvidia-smi -L >/dev/null 2>&1; then
      run_tests cuda -L gpu
    else
      say "The CUDA backend is built and not run: there is no device"
    fi
  else
    say "The CUDA backend is not built: there is no nvcc"
  fi
fi

say "All passed"
printf '%s\n' "${summary[@]}"
echo "$passed passed, 0 failed, $skipped skipped"
