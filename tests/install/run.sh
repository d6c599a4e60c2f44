#!/usr/bin/env bash
# Runs all checks of this folder and prints one table. Takes about two hours on two cores; README.md has the last table.
#
#   bash tests/install/run.sh            all parts
#   bash tests/install/run.sh PART...    of: bullet compilers msvc windows aarch64 lanes packages conan conda vcpkg cuda
#
# A part whose tools are missing is skipped. The rows that a part prints are in build/install/results/PART.md.
set -uo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
results=$here/../../build/install/results
mkdir -p "$results"

# command_of PART: prints what runs it, or nothing
command_of() {
  case $1 in
    bullet) echo bullet.sh ;;
    compilers) echo compilers.sh ;;
    msvc) echo msvc.sh ;;
    windows | aarch64) echo "cross.sh $1" ;;
    lanes) echo cross/lanes.sh ;;
    packages) echo packages.sh ;;
    conan) echo conan.sh ;;
    conda) echo conda.sh ;;
    vcpkg) echo "vcpkg.sh ${VCPKG_ROOT:-}" ;;
    cuda) echo cuda.sh ;;
  esac
}

# Whether the tools of a part are there.
can_run() {
  case $1 in
    windows) command -v x86_64-w64-mingw32-g++-posix && [ -x /usr/lib/wine/wine64 ] ;;
    aarch64 | lanes) command -v aarch64-linux-gnu-g++ && command -v qemu-aarch64-static ;;
    msvc) command -v clang++-19 && [ -d /usr/x86_64-w64-mingw32/include ] ;;
    conan) command -v conan ;;
    vcpkg) [ -e "${VCPKG_ROOT:-}/scripts/ports.cmake" ] ;;
    cuda) command -v nvcc ;;
  esac >/dev/null
}

# What stands in the table: the number of rows, or what was tested.
summary_of() {
  local rows=$results/$1.md
  case $1 in
    windows | aarch64) grep -E 'tests passed' "$rows" ;;
    lanes) paste -sd ';' "$rows" ;;
    *) echo "$(grep -c '^|' "$rows") rows" ;;
  esac
}

[ $# -gt 0 ] || set -- bullet compilers msvc windows aarch64 lanes packages conan conda vcpkg cuda
status=0
table=()
for part in "$@"; do
  command=$(command_of "$part")
  if [ -z "$command" ]; then
    sed -n '4,5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
  fi
  if ! can_run "$part"; then
    table+=("| $part | skipped: its tools are missing | |")
    continue
  fi
  start=$SECONDS
  # shellcheck disable=SC2086
  if bash "$here"/$command >"$results/$part.md" 2>"$results/$part.log"; then
    result="passed, $(summary_of "$part")"
  else
    result="FAILED, see $results/$part.log" status=1
  fi
  table+=("| $part | $result | $(((SECONDS - start + 30) / 60)) |")
  echo "${table[-1]}" >&2
done
printf '%s\n' '| part | result | minutes |' '|---|---|---|' "${table[@]}"
exit $status
