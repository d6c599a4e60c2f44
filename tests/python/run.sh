#!/usr/bin/env bash
# Installs the Python package in a fresh virtual environment and runs its tests there.
#
#   bash tests/python/run.sh                 the detector: some 20 s after a build of the project
#   bash tests/python/run.sh --pybullet      also the plugin library in PyBullet, sweeps, recipes and the notebook;
#                                            builds Bullet, some 10 minutes, and from Python 3.12 on PyBullet, 10 more
#
# The detector is taken from build/cpu if tests/run.sh --all has built it; its program is compared with the
# package then. PYTHON names the interpreter; LAZYCCD_PYBULLET_SDIST the sources of PyBullet, if they need
# not be downloaded. Exit code 77: there is no Python 3.8 or later with venv, or no package index can be
# reached. Everything else that goes wrong is a failure.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"

python=${PYTHON:-python3}
if ! "$python" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 8))' 2>/dev/null; then
  echo "SKIPPED: there is no Python 3.8 or later with venv"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m venv "$work/venv"
pip=("$work/venv/bin/python" -m pip --quiet --disable-pip-version-check)
package=$repository/plugin/python

options=() tests=("$repository/tests/python")
if [ "${1:-}" = --pybullet ]; then
  require_packages python pybullet
  [ -z "${LAZYCCD_PYBULLET_SDIST:-}" ] ||
    options+=(-C "cmake.define.LAZYCCD_PYBULLET_SDIST=$LAZYCCD_PYBULLET_SDIST")
  requirements=("$package[pybullet,recipes,test]") isolation=() build=$repository/build/python-pybullet
else
  options+=(-C cmake.define.LAZYCCD_PYBULLET=OFF)
  requirements=("$package[test]") isolation=(--no-build-isolation) build=$work/build
fi
built=$repository/build/cpu
if [ -x "$built/examples/lazyccd" ]; then
  export LAZYCCD_PROGRAM=$built/examples/lazyccd
  if [ "${1:-}" != --pybullet ] &&
    cmake --install "$built" --prefix "$work/installed" >/dev/null 2>&1; then
    options+=(-C cmake.define.LAZYCCD_INSTALLED=ON -C "cmake.define.CMAKE_PREFIX_PATH=$work/installed")
  fi
fi
if command -v ccache >/dev/null; then
  export CCACHE_SLOPPINESS=pch_defines,time_macros
  options+=(-C cmake.define.CMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

say "Installing the Python package"
# Only a first question that nobody answers skips the tests: pip asks the index for itself.
if ! answer=$("${pip[@]}" download --no-deps --no-cache-dir --dest "$work/index" pip 2>&1); then
  if grep -qE 'NewConnectionError|ConnectTimeoutError|Failed to establish|Could not fetch URL|No matching distribution' \
    <<<"$answer"; then
    echo "SKIPPED: pip reaches no package index"
    exit 77
  fi
  echo "$answer" >&2
  exit 1
fi
"${pip[@]}" install --upgrade 'pip>=23.1' numpy pytest scikit-build-core nanobind
"${pip[@]}" install "${isolation[@]}" -C "build-dir=$build" "${options[@]}" "${requirements[@]}"
say "Testing the Python package"
cd "$work"
PYTHONDONTWRITEBYTECODE=1 "$work/venv/bin/python" -m pytest -q -rs -p no:cacheprovider "${tests[@]}"
