#!/usr/bin/env bash
# Builds the overlay port of vcpkg, release and debug, by vcpkg's own scripts, and programs that use it through vcpkg's
# toolchain file. Takes about four minutes.
#
#   bash tests/install/vcpkg.sh FOLDER [TRIPLET]    FOLDER is a checkout of vcpkg; x64-linux or x64-linux-release
#   FEATURES=core bash tests/install/vcpkg.sh ...   the detector alone
#
# The program vcpkg is not needed: what it would install before is put into place here. Bullet is Debian's in double,
# with a config file like that of vcpkg's port; Boost and Eigen are the system's. vcpkg's choice of versions is not tested.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

[ -e "${1:-}/scripts/ports.cmake" ] || { sed -n '5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
vcpkg=$(cd "$1" && pwd)
triplet=${2:-x64-linux}
build=$bullets/vcpkg
installed=$build/installed
: >"$log"
rm -rf "$build"
mkdir -p "$installed/$triplet"
layout_bullet=debian
cp -r "$(bullet_layout vcpkg)/." "$installed/$triplet"

# port NAME FOLDER [CMAKE OPTION...]: builds a port and installs it
port() {
  local name=$1 folder=$2 configs=()
  shift 2
  for config in "$installed/$triplet"/share/vcpkg-cmake*/vcpkg-port-config.cmake; do
    [ -e "$config" ] && configs+=("$config")
  done
  cmake -DCMD=BUILD -DPORT="$name" -DVERSION=0.2.0 -DCURRENT_PORT_DIR="$folder" -DVCPKG_ROOT_DIR="$vcpkg" \
    -DTARGET_TRIPLET=$triplet -D_HOST_TRIPLET=$triplet -DTARGET_TRIPLET_FILE="$(find "$vcpkg/triplets" -name "$triplet.cmake")" \
    -D_VCPKG_INSTALLED_DIR="$installed" -DPACKAGES_DIR="$build/packages" -DBUILDTREES_DIR="$build/trees" \
    -DDOWNLOADS="$build/downloads" -DVCPKG_CONCURRENCY="$jobs" -DVCPKG_BASE_VERSION=2999-12-31 \
    -DNINJA="$(command -v ninja)" -DPKGCONFIG="$(command -v pkg-config)" \
    -DVCPKG_PORT_CONFIGS="$(IFS=';'; echo "${configs[*]}")" "$@" -P "$vcpkg/scripts/ports.cmake" >>"$log" 2>&1
  cp -r "$build/packages/${name}_$triplet/." "$installed/$triplet"
}
port vcpkg-cmake "$vcpkg/ports/vcpkg-cmake"
port vcpkg-cmake-config "$vcpkg/ports/vcpkg-cmake-config"
port lazyccd "$repository/plugin/packages/vcpkg/lazyccd" -DFEATURES="${FEATURES:-core;bullet}"

# The package may not hold what vcpkg's own check of packages refuses.
package=$build/packages/lazyccd_$triplet
for path in debug/include debug/share lib/cmake share/doc; do
  [ ! -e "$package/$path" ] || { echo "The package must not hold $path" >&2; exit 1; }
done
test -e "$package/share/lazyccd/copyright"

types=(Release Debug)
case $triplet in *-release) types=(Release) ;; esac
for type in "${types[@]}"; do
  cmake -S "$repository/tests/consumer_find_package" -B "$build/$type" "${compiler_options[@]}" -DCMAKE_BUILD_TYPE=$type \
    --toolchain "$vcpkg/scripts/buildsystems/vcpkg.cmake" -DVCPKG_MANIFEST_MODE=OFF -DVCPKG_TARGET_TRIPLET=$triplet \
    -DVCPKG_INSTALLED_DIR="$installed" -DZ_VCPKG_ROOT_DIR="$vcpkg" >>"$log" 2>&1
  cmake --build "$build/$type" -j "$jobs" >>"$log" 2>&1
  ctest --test-dir "$build/$type" --output-on-failure >>"$log" 2>&1
  program=$build/$type/consumer_bullet_double
  hashes=
  [ ! -e "$program" ] || hashes=$("$program" | sed -n 's/.*hash //p' | paste -sd ' ')
  echo "| vcpkg's overlay port, $triplet, $type | find_package | programs run $hashes |"
done
