#!/usr/bin/env bash
# Runs the life of PyBullet's worlds under the address sanitizer and under valgrind. By hand; the last result
# stands in memory.md beside this file.
#
#   bash tests/python/check_memory.sh [asan] [valgrind]       both by default
#
# Only what has LazyCCD's libraries in its stack counts: Python, NumPy and PyBullet's wheel are not instrumented.
# PYTHON and LAZYCCD_PYBULLET_SDIST as in run.sh.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
here=$repository/tests/python
[ $# -gt 0 ] || set -- asan valgrind

require_packages core python memory
build=$repository/build/python-memory
mkdir -p "$build"
[ -x "$build/venv/bin/python" ] || "${PYTHON:-python3}" -m venv "$build/venv"
python=$build/venv/bin/python
"$python" -m pip --quiet install --upgrade 'pip>=23.1' numpy pytest scikit-build-core nanobind pybullet==3.2.7

# install NAME CMAKE OPTION...: builds the package into build/python-memory/NAME.
install() {
  local name=$1 options=()
  shift
  for option in "$@" ${LAZYCCD_PYBULLET_SDIST:+LAZYCCD_PYBULLET_SDIST=$LAZYCCD_PYBULLET_SDIST}; do
    options+=(-C "cmake.define.$option")
  done
  if command -v ccache >/dev/null; then
    export CCACHE_SLOPPINESS=pch_defines,time_macros
    options+=(-C cmake.define.CMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  say "Building the package for $name"
  "$python" -m pip --quiet install --no-build-isolation --no-deps --upgrade --target "$build/$name" \
    -C install.strip=false -C "build-dir=$build/$name-build" "${options[@]}" "$repository/plugin/python"
}

for tool in "$@"; do
  case $tool in
    asan)
      # All of "undefined" but vptr, which compares type information of PyBullet's objects with the library's.
      checks=address,shift,integer-divide-by-zero,unreachable,return,signed-integer-overflow,bounds,alignment
      checks+=,object-size,float-cast-overflow,bool,enum,null,nonnull-attribute,pointer-overflow
      install asan LAZYCCD_SANITIZE=$checks CMAKE_BUILD_TYPE=RelWithDebInfo
      say "Address and undefined behaviour sanitizers"
      runtime=$(gcc -print-file-name=libasan.so):$(gcc -print-file-name=libubsan.so):$(gcc -print-file-name=libstdc++.so)
      # Bullet's nodes come from the wheel's operator new and go by the library's own operator delete, which is
      # linked in. Both are malloc and free; so neither tool is to report it.
      printf 'leak:%s\n' python3 libpython numpy pybullet. _native >"$build/leaks"
      (cd "$build" && LD_PRELOAD=$runtime PYTHONMALLOC=malloc PYTHONPATH=$build/asan PYTHONDONTWRITEBYTECODE=1 \
        ASAN_OPTIONS=detect_leaks=1:alloc_dealloc_mismatch=0:strict_init_order=1:detect_stack_use_after_return=1 \
        UBSAN_OPTIONS=print_stacktrace=1 LSAN_OPTIONS=suppressions=$build/leaks:print_suppressions=0 \
        "$python" "$here/memory_life.py" 10)
      ;;
    valgrind)
      install valgrind CMAKE_BUILD_TYPE=RelWithDebInfo
      say "Valgrind"
      (cd "$build" && PYTHONMALLOC=malloc PYTHONPATH=$build/valgrind PYTHONDONTWRITEBYTECODE=1 \
        valgrind --quiet --leak-check=full --show-leak-kinds=definite --num-callers=40 --error-limit=no \
        --show-mismatched-frees=no \
        --xml=yes --xml-file=valgrind.xml "$python" "$here/memory_life.py" 1)
      "$python" "$here/memory_report.py" "$build/valgrind.xml"
      ;;
    *) echo "there is no check '$tool'" >&2; exit 2 ;;
  esac
done
