#!/usr/bin/env bash
# Makes the packages of LazyCCD (.deb and .tar.gz, shared libraries) and builds programs from them, by CMake and by
# pkg-config. Needs Debian's Bullet. Takes about four minutes.
#
#   bash tests/install/packages.sh
#
# Nothing is installed on this machine: the packages are unpacked in build/install/packages.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

build=$bullets/packages
made=$build/made
: >"$log"
cmake -S "$repository" -B "$build" "${compiler_options[@]}" -DBUILD_SHARED_LIBS=ON -DLAZYCCD_CUDA=OFF \
  -DLAZYCCD_EXAMPLES=OFF -DCMAKE_INSTALL_PREFIX=/usr >>"$log" 2>&1
cmake --build "$build" -j "$jobs" >>"$log" 2>&1
rm -rf "$made" && mkdir -p "$made"
(cd "$build" && for kind in DEB TGZ; do cpack -G $kind -B "$made"; done) >>"$log" 2>&1

# A program by find_package, in build folder $1, from prefix $2.
by_cmake() {
  cmake -S "$repository/tests/consumer_find_package" -B "$1" "${compiler_options[@]}" -DCMAKE_PREFIX_PATH="$2" >>"$log" 2>&1
  cmake --build "$1" -j "$jobs" >>"$log" 2>&1
  ctest --test-dir "$1" --output-on-failure >>"$log" 2>&1
  echo "| $3 | find_package | $("$1/consumer_bullet" | sed -n 's/.*hash //p' | paste -sd ' ') | $("$1/consumer_bullet_double" | sed -n 's/.*hash //p' | paste -sd ' ') |"
}

# A program by pkg-config alone, from prefix $1.
by_pkg_config() {
  local libraries=$1/$2 module hashes=()
  for module in lazyccd-bullet lazyccd-bullet-double; do
    # shellcheck disable=SC2046
    PKG_CONFIG_PATH=$libraries/pkgconfig c++ -std=c++17 "$repository/tests/consumer_find_package/bullet.cpp" \
      -o "$1/$module" $(PKG_CONFIG_PATH=$libraries/pkgconfig pkg-config --cflags --libs $module lazyccd)
    hashes+=("$(LD_LIBRARY_PATH=$libraries "$1/$module" | sed -n 's/.*hash //p' | paste -sd ' ')")
  done
  echo "| $3 | pkg-config | ${hashes[0]} | ${hashes[1]} |"
}

for deb in "$made"/*.deb; do dpkg -x "$deb" "$build/deb"; done
mkdir -p "$build/tar"
for archive in "$made"/*.tar.gz; do tar xf "$archive" -C "$build/tar" --strip-components 1; done
folder=$(cd "$build/deb/usr" && find . -name lazyccd.pc)
folder=$(dirname "$(dirname "$folder")")
by_cmake "$build/by_deb" "$build/deb/usr" .deb
by_pkg_config "$build/deb/usr" "$folder" .deb
prefix=$(dirname "$(dirname "$(find "$build/tar" -path '*include/lazyccd' -type d)")")
by_cmake "$build/by_tar" "$prefix" .tar.gz

# Shared libraries have a version in their name, and show the public interface only. LazyCCD::research needs
# four names more.
library=$(find "$build/deb" -name 'liblazyccd_core.so.*.*.*')
readelf -d "$library" | sed -n 's/.*soname: \[\(.*\)\]/soname \1/p'
hidden=$(nm -DC --defined-only "$library" | grep -c 'lazyccd::' || true)
echo "$hidden names of LazyCCD are shown by $(basename "$library")"
for_research='CpuDetector::deviates_little|ThreadPool::start|Mesh::collide|Mesh::view'
if nm -DC --defined-only "$library" | grep -vE "$for_research" | grep -E 'CpuDetector|ThreadPool::|Mesh::'; then
  echo "Private names are shown" >&2
  exit 1
fi
dpkg-deb -I "$made"/liblazyccd-dev*.deb | grep Depends
