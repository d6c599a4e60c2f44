#!/usr/bin/env bash
# Checks the sources of both libraries and of the examples with every compiler that is installed, warnings
# as errors. Nothing is linked; code is not generated. Takes about a minute and a half for each compiler.
#
#   bash tests/install/compilers.sh [COMPILER...]     e.g. clang++-19 or "clang++-14 -stdlib=libc++"
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"

[ $# -gt 0 ] || set -- g++-11 g++-12 clang++-14 "clang++-14 -stdlib=libc++" clang++-16 clang++-19
status=0
for compiler in "$@"; do
  read -r program flags <<<"$compiler"
  if ! command -v "$program" >/dev/null; then
    echo "| $compiler | not installed |"
    continue
  fi
  build=$repository/build/install/compiler/${compiler// /}
  log=$build.txt
  mkdir -p "$(dirname "$build")"
  cmake -S "$repository" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER="$program" -DCMAKE_CXX_FLAGS="$flags" \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DLAZYCCD_CUDA=OFF -DLAZYCCD_WERROR=ON \
    -DLAZYCCD_TESTS=OFF -DLAZYCCD_BENCHES=OFF -DLAZYCCD_PRECOMPILED_HEADERS=OFF ${OPTIONS:-} >"$log" 2>&1
  # Each command of the build, without its output and code generation.
  sources=$(sed -nE 's/^ *"command": "(.*)",?$/\1/p' "$build/compile_commands.json" | sed 's/\\"/"/g; s/\\\\/\\/g' |
    grep -vE 'CMakeFiles/(lazyccd_bullet3|.*_double)' | sed -E 's/ -o [^ ]+ -c / -fsyntax-only /')
  if (cd "$build" && printf '%s\n' "$sources" | xargs -P "$jobs" -d '\n' -n 1 bash -c) >>"$log" 2>&1; then
    echo "| $("$program" --version | head -1) $flags | $(printf '%s\n' "$sources" | wc -l) sources, no warnings |"
  else
    echo "| $compiler | FAILED, see $log |"
    status=1
  fi
done
exit $status
