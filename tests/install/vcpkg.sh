#!/usr/bin/env bash
# Builds the overlay port of vcpkg, release and debug, by vcpkg's own scripts, and programs that use it through vcpkg's
# toolchain file. Takes about four minutes.
#
#   bash tests/install/vcpkg.sh FOLDER    FOLDER is a checkout of vcpkg
#
# The program vcpkg is not needed: what it would install before (Bullet, vcpkg-cmake) is put into place here; Boost and
# Eigen are the system's. Its choice of versions and of binaries is not tested.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

[ -e "${1:-}/scripts/ports.cmake" ] || { sed -n '5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
vcpkg=$(cd "$1" && pwd)
triplet=x64-linux
build=$bullets/vcpkg
installed=$build/installed
: >"$log"
rm -rf "$build"
mkdir -p "$installed/$triplet"
cp -r "$(bullet_layout vcpkg)/." "$installed/$triplet"

# port NAME FOLDER [CMAKE OPTION...]: builds a port and installs it
port() {
  local name=$1 folder=$2 configs=()
  shift 2
  for config in "$installed/$triplet"/share/vcpkg-cmake*/vcpkg-port-config.cmake; do
    [ -e "$config" ] && configs+=("$config")
  done
  cmake -DCMD=BUILD -DPORT="$name" -DVERSION=0.1.0 -DCURRENT_PORT_DIR="$folder" -DVCPKG_ROOT_DIR="$vcpkg" \
    -DTARGET_TRIPLET=$triplet -D_HOST_TRIPLET=$triplet -DTARGET_TRIPLET_FILE="$vcpkg/triplets/$triplet.cmake" \
    -D_VCPKG_INSTALLED_DIR="$installed" -DPACKAGES_DIR="$build/packages" -DBUILDTREES_DIR="$build/trees" \
    -DDOWNLOADS="$build/downloads" -DVCPKG_CONCURRENCY="$jobs" -DVCPKG_BASE_VERSION=2999-12-31 \
    -DVCPKG_PORT_CONFIGS="$(IFS=';'; echo "${configs[*]}")" "$@" -P "$vcpkg/scripts/ports.cmake" >>"$log" 2>&1
  cp -r "$build/packages/${name}_$triplet/." "$installed/$triplet"
}
port vcpkg-cmake "$vcpkg/ports/vcpkg-cmake"
port vcpkg-cmake-config "$vcpkg/ports/vcpkg-cmake-config"
port lazyccd "$repository/plugin/packages/vcpkg/lazyccd" '-DFEATURES=core;bullet'

# The package may not hold what vcpkg's own check of packages refuses.
package=$build/packages/lazyccd_$triplet
for path in debug/include debug/share lib/cmake share/doc; do
  [ ! -e "$package/$path" ] || { echo "The package must not hold $path" >&2; exit 1; }
done
test -e "$package/share/lazyccd/copyright"

for type in Release Debug; do
  cmake -S "$repository/tests/consumer_find_package" -B "$build/$type" "${compiler_options[@]}" -DCMAKE_BUILD_TYPE=$type \
    --toolchain "$vcpkg/scripts/buildsystems/vcpkg.cmake" -DVCPKG_MANIFEST_MODE=OFF -DVCPKG_TARGET_TRIPLET=$triplet \
    -DVCPKG_INSTALLED_DIR="$installed" -DZ_VCPKG_ROOT_DIR="$vcpkg" >>"$log" 2>&1
  cmake --build "$build/$type" -j "$jobs" >>"$log" 2>&1
  ctest --test-dir "$build/$type" --output-on-failure >>"$log" 2>&1
  echo "| vcpkg's overlay port, $type | find_package | $("$build/$type/consumer_bullet_double" | sed -n 's/.*hash //p' | paste -sd ' ') |"
done
