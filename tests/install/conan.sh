#!/usr/bin/env bash
# Builds the Conan package with the system's Bullet, Boost and Eigen, and the program that tests it. Needs Conan 2
# (pip install conan). Takes two minutes.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
export CONAN_HOME=$repository/build/install/conan
conan profile detect --force >/dev/null
conan create "$repository/plugin/packages/conan" -o 'lazyccd/*:dependencies=system' -s compiler.cppstd=17 \
  -c tools.cmake.cmake_layout:test_folder="$CONAN_HOME/test" -c tools.cmake.cmaketoolchain:user_presets=
