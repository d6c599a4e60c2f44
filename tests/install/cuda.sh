#!/usr/bin/env bash
# Compiles the CUDA backend for all architectures that a compiler knows from 75 to 120, and runs a program that is
# linked with it on this machine. Takes a quarter of an hour for each compiler.
#
#   bash tests/install/cuda.sh [NVCC...]    e.g. /usr/local/cuda-12.4/bin/nvcc; CUDAHOSTCXX is the host compiler
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

[ $# -gt 0 ] || set -- nvcc
for nvcc in "$@"; do
  version=$("$nvcc" --version | sed -n 's/.*release \([0-9.]*\).*/\1/p')
  architectures=${ARCHITECTURES:-$("$nvcc" --list-gpu-arch | sed -n 's/^compute_\([0-9]*\)$/\1/p' |
    awk '$1 >= 75 && $1 <= 120 { printf "%s%s-real", separator, $1; separator = ";" }')}
  build=$bullets/cuda/$version
  mkdir -p "$build"
  cmake -S "$repository" -B "$build" "${compiler_options[@]}" -DCMAKE_CUDA_COMPILER="$(command -v "$nvcc")" \
    -DCMAKE_CUDA_ARCHITECTURES="$architectures" -DLAZYCCD_BULLET=OFF -DLAZYCCD_TESTS=OFF -DLAZYCCD_EXAMPLES=OFF \
    >"$build.txt" 2>&1
  cmake --build "$build" -j "$jobs" --target lazyccd_core >>"$build.txt" 2>&1
  runtime=$(sed -n 's/^CUDA_cudart_static_LIBRARY:FILEPATH=//p' "$build/CMakeCache.txt")
  c++ -std=c++17 -O2 -I "$repository/cuda/include" "$repository/examples/hello/detector.cpp" -o "$build/detector" \
    "$build/cuda/liblazyccd_core.a" "$runtime" -pthread -ldl -lrt
  # It needs neither the runtime nor the driver to start.
  if readelf -d "$build/detector" | grep -E 'libcuda'; then exit 1; fi
  "$build/detector" >"$build.run.txt"
  echo "| nvcc $version | ${architectures//-real/} | $(du -h "$build/cuda/liblazyccd_core.a" | cut -f1) | $(tail -1 "$build.run.txt") |"
done
