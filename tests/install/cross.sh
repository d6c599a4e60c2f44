#!/usr/bin/env bash
# Builds the tests for another machine, with Bullet's sources, and runs them in an emulator.
#
#   bash tests/install/cross.sh aarch64 [CTEST OPTION...]    ARM of 64 bits, under qemu
#   bash tests/install/cross.sh windows [CTEST OPTION...]    Windows of 64 bits, under Wine
#
# Tests against exact truth are left out, for FLINT is not there. Takes half an hour for each.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

case ${1:-} in
  aarch64) compiler=aarch64-linux-gnu-g++ run=(qemu-aarch64-static -L /usr/aarch64-linux-gnu) ;;
  windows) compiler=x86_64-w64-mingw32-g++-posix run=(/usr/lib/wine/wine64) ;;
  *) sed -n '4,5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
for program in "$compiler" "${run[0]}"; do
  command -v "$program" >/dev/null || { echo "$program is missing; Debian's packages are listed in README.md beside" >&2; exit 2; }
done
target=$1
version=${BULLET:-3.24}
precision=${PRECISION:-float}
suffix=$([ "$precision" = double ] && echo _double || true)
build=$bullets/cross/$target
root=$bullets/cross/root
export WINEDEBUG=-all

# The headers of libraries without code of their own, away from the headers of this machine.
if [ ! -d "$root" ]; then
  mkdir -p "$root/include" "$root/lib/cmake" "$root/share/cmake"
  for library in boost eigen3 catch2 CLI nlohmann; do ln -s "/usr/include/$library" "$root/include"; done
  cp -r /usr/lib/cmake/Catch2 "$root/lib/cmake"
  cp -r /usr/share/cmake/CLI11 /usr/share/cmake/nlohmann_json "$root/share/cmake"
  cp -r /usr/share/eigen3 "$root/share"
  # Only the header of Catch2, not its library.
  cat >"$root/lib/cmake/Catch2/Catch2Config.cmake" <<END
add_library(Catch2::Catch2 INTERFACE IMPORTED)
target_include_directories(Catch2::Catch2 INTERFACE $root/include)
list(APPEND CMAKE_MODULE_PATH \${CMAKE_CURRENT_LIST_DIR})
END
fi

cmake -S "$repository" -B "$build" "${compiler_options[@]}" --toolchain "$repository/tests/install/cross/$target.cmake" \
  -DLAZYCCD_CROSS_ROOT="$root" -DBoost_NO_BOOST_CMAKE=ON -DCMAKE_PREFIX_PATH="$root" \
  -DLAZYCCD_BULLET_ROOT="$(bullet_source "$version")" -DLAZYCCD_PRECISIONS="$precision" -DLAZYCCD_CUDA=OFF \
  -DLAZYCCD_BENCHES=OFF -DLAZYCCD_TESTS=ON -DLAZYCCD_WERROR=ON -DLAZYCCD_BULLET_TESTS="plugin/(links|bodies|solver|world)/" \
  >"$build.txt" 2>&1
targets=(lazyccd_tests "lazyccd_tests_bullet$suffix")
cmake --build "$build" -j "$jobs" --target "${targets[@]}" "example_bullet$suffix" >>"$log" 2>&1
# The program whose hashes bullet.sh compares.
double=$([ "$precision" = double ] && echo "-DLAZYCCD_BULLET_DOUBLE=1 -DBT_USE_DOUBLE_PRECISION" || echo -DLAZYCCD_BULLET_DOUBLE=0)
# shellcheck disable=SC2086
"$compiler" -std=c++17 -O2 -ffp-contract=off -fno-ipa-ra -static $double -I "$repository/cuda/include" -I "$repository/plugin/include" \
  -isystem "$(bullet_source "$version")/src" "$repository/tests/consumer_find_package/bullet.cpp" -o "$build/hashes.exe" \
  "$build/plugin/liblazyccd_bullet$suffix.a" "$build/cuda/liblazyccd_core.a" \
  "$(find "$build" -name "liblazyccd_bullet3_$precision.a")" -pthread
"${run[@]}" "$build/hashes.exe"
shift
LAZYCCD_QUICK_TESTS=1 ctest --test-dir "$build" -j "$jobs" -L "^(core|bullet$suffix)$" "$@" | tee "$build.ctest.txt"
