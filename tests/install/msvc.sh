#!/usr/bin/env bash
# Checks that the sources of both libraries compile for Visual C++: Clang for that target, in Microsoft's mode, with
# the headers of libc++ and of MinGW-w64 in place of Microsoft's. Takes four minutes.
#
#   bash tests/install/msvc.sh [CLANG]    clang++-19 if nothing is given
#
# Needs Debian's clang-19, libc++-19-dev and mingw-w64-x86-64-dev. Nothing is linked. The kernels are in plain C++
# (LAZYCCD_PLAIN_CPP), as cl.exe has them. What only cl.exe refuses is not found.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

clang=${1:-clang++-19}
windows=/usr/x86_64-w64-mingw32/include
if ! command -v "$clang" >/dev/null || [ ! -d "$windows" ]; then
  echo "$clang or $windows is missing" >&2
  exit 2
fi
libraries=$("$clang" -stdlib=libc++ -E -x c++ - -v </dev/null 2>&1 | sed -n 's/^ \(.*c++\/v1\)$/\1/p' | head -1)
build=$bullets/msvc
mkdir -p "$build/include"
# Eigen asks for Microsoft's header of intrinsics, which contradicts that of MinGW-w64.
: >"$build/include/intrin.h"
for library in boost eigen3; do ln -sfn "/usr/include/$library" "$build/include/$library"; done

flags=(--target=x86_64-pc-windows-msvc -fsyntax-only -std=c++17 -fms-extensions -fms-compatibility
  -fms-compatibility-version=19.38 -fgnuc-version=4.2.1 -nostdinc -nostdinc++
  -isystem "$build/include" -isystem "$build/include/eigen3" -isystem "$libraries"
  -isystem "$("$clang" -print-resource-dir)/include" -isystem "$windows"
  -D_LIBCPP_NO_VCRUNTIME -D_LIBCPP_ENABLE_CXX17_REMOVED_UNARY_BINARY_FUNCTION -D_UCRT -D__MINGW_FORTIFY_LEVEL=0
  -D__MINGW_ATTRIB_DEPRECATED= -D__MINGW_ATTRIB_DEPRECATED_SEC_WARN=
  -include "$repository/tests/install/cross/msvc_declarations.h"
  -DNOMINMAX -D_USE_MATH_DEFINES -DNDEBUG -DLAZYCCD_PLAIN_CPP -DLAZYCCD_ISA=baseline -DLAZYCCD_SHARED
  -I "$repository/cuda" -I "$repository/cuda/include")
: >"$build/log.txt"
# check FOLDER FLAG...: counts the sources of a folder that compile
check() {
  local folder=$1 sources
  shift
  sources=$(find "$repository/$folder" -name '*.cpp' -not -path '*/python/*' -not -path '*/cmake/*' -not -path '*/packages/*')
  printf '%s\n' "$sources" | xargs -P "$jobs" -I '{}' "$clang" "${flags[@]}" "$@" '{}' >>"$build/log.txt" 2>&1 ||
    { echo "| $folder | FAILED, see $build/log.txt |"; exit 1; }
  echo "| $folder | $(printf '%s\n' "$sources" | wc -l) sources, no errors |"
}
check cuda -DLAZYCCD_CORE_EXPORTS
check plugin -DLAZYCCD_BULLET_EXPORTS -DLAZYCCD_BULLET_DOUBLE=0 -I "$repository/plugin" -I "$repository/plugin/include" \
  -isystem "$(bullet_source 3.24)/src"
