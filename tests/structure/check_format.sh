#!/usr/bin/env bash
# Fails if a C++ or CUDA source is not formatted as .clang-format says. Exit code 77: clang-format 14, which
# the sources are formatted with, is not installed; other versions format a little differently.
#
#   bash tests/structure/check_format.sh          # add --fix to format
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for tool in clang-format-14 clang-format; do
  "$tool" --version 2>/dev/null | grep -q 'version 14\.' && break
  tool=
done
[ -n "$tool" ] || { echo "SKIPPED: clang-format 14 is not installed"; exit 77; }
mode=(--dry-run -Werror)
[ "${1:-}" = --fix ] && mode=(-i)
find plugin cuda examples tests -path plugin/python/build -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' \) -print0 |
  xargs -0 -n 40 -P 2 "$tool" "${mode[@]}"
