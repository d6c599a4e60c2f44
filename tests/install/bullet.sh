#!/usr/bin/env bash
# Builds LazyCCD with Bullet as people have it, and runs tests of the adapter. Takes half an hour on two cores.
#
#   bash tests/install/bullet.sh              every case
#   bash tests/install/bullet.sh --layouts    only finds Debian's Bullet, in the layouts of package managers: a minute
#   bash tests/install/bullet.sh --list       lists the cases
#   bash tests/install/bullet.sh CASE...      these cases
#
# A case is VERSION-PRECISION-WAY. Its row shows what was found, the tests, and hashes of the motion in both
# worlds; one precision must always have the same. A case that begins with "find" only builds and runs a
# program that uses Bullet's libraries.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"
source "$(dirname "${BASH_SOURCE[0]}")/bullets.sh"

# Tests that compare with Bullet bit by bit, and random scenes in both worlds.
tests='plugin/(links|bodies|world)/'

cases=(debian-float debian-double 3.24-float-root 3.24-double-FetchContent 3.26-float-add_subdirectory
  3.26-double-config 3.26-float-sources 3.26-double-sources 3.26-double-shared-threads)
for version in 3.24 3.26; do
  for precision in float double; do
    for way in root config add_subdirectory FetchContent; do cases+=("find-$version-$precision-$way"); done
  done
done
cases+=(find-vcpkg find-folders find-conda find-homebrew find-shared find-threads)

suffix_of() { [ "$1" = double ] && echo _double || true; }

# build_and_test SOURCE BUILD PRECISION [CMAKE OPTION...]: sets row to what was found and tested
build_and_test() {
  local source=$1 build=$2 precision=$3 found count program
  shift 3
  cmake -S "$source" -B "$build" "${compiler_options[@]}" -DLAZYCCD_CUDA=OFF -DLAZYCCD_EXAMPLES=ON \
    -DLAZYCCD_BENCHES=OFF -DLAZYCCD_TESTS=ON -DLAZYCCD_BULLET_TESTS="$tests" "$@" >"$build.txt" 2>&1
  found=$(sed -n 's/^-- LazyCCD: Bullet /Bullet /p' "$build.txt" | sed "s|$bullets/||" | tr '\n' ';')
  program=lazyccd_tests_bullet$(suffix_of "$precision")
  cmake --build "$build" -j "$jobs" --target "$program" >>"$log" 2>&1
  count=$(LAZYCCD_QUICK_TESTS=1 "$(find "$build" -type f -name "$program")" | tail -2 | head -1)
  row="${found%;} | $count"
}

# The installed package serves a program, which prints the hashes.
consumer() {
  local build=$1 precision=$2
  shift 2
  cmake --build "$build" -j "$jobs" --target "lazyccd_bullet$(suffix_of "$precision")" >>"$log" 2>&1
  cmake --install "$build" --prefix "$build/prefix" >>"$log" 2>&1
  cmake -S "$repository/tests/consumer_find_package" -B "$build/consumer" "${compiler_options[@]}" \
    -DLazyCCD_DIR="$(dirname "$(find "$build/prefix" -name LazyCCDConfig.cmake)")" "$@" >>"$log" 2>&1
  cmake --build "$build/consumer" -j "$jobs" >>"$log" 2>&1
  hashes "$build/consumer/consumer_bullet$(suffix_of "$precision")"
}

hashes() { "$1" | sed -n 's/.*hash //p' | tr '\n' ' '; }

run_case() {
  local name=$1 build=$bullets/case/$1 version precision way prefix options=() hash=
  mkdir -p "$bullets/case"
  IFS=- read -r version precision way <<<"$name"
  case $name in
    debian-*)
      build_and_test "$repository" "$build" "$precision" -DLAZYCCD_PRECISIONS="$precision"
      hash=$(consumer "$build" "$precision") version=3.24
      ;;
    find-*)
      find_case "${name#find-}" "$build"
      return
      ;;
    *-add_subdirectory | *-FetchContent)
      [ "$precision" = double ] && options=(-DUSE_DOUBLE_PRECISION=ON)
      build_and_test "$repository/tests/install/bullet_in_project" "$build" "$precision" "${options[@]}" \
        -DWAY="$way" -DLAZYCCD_SOURCE_DIR="$repository" -DBULLET_SOURCE_DIR="$(bullet_source "$version")"
      cmake --build "$build" -j "$jobs" --target "consumer_bullet$(suffix_of "$precision")" >>"$log" 2>&1
      hash=$(hashes "$build/consumer_bullet$(suffix_of "$precision")")
      ;;
    *)
      case $way in
        config) options=(-DCMAKE_PREFIX_PATH="$(bullet_prefix "$version-$precision")") ;;
        root) options=(-DLAZYCCD_BULLET_ROOT="$(bullet_prefix "$version-$precision")") ;;
        sources) options=(-DLAZYCCD_BULLET_ROOT="$(bullet_source "$version")") ;;
        *) options=(-DLAZYCCD_BULLET_ROOT="$(bullet_prefix "$name")") ;;
      esac
      build_and_test "$repository" "$build" "$precision" "${options[@]}" -DLAZYCCD_PRECISIONS="$precision"
      hash=$(consumer "$build" "$precision" "${options[@]}")
      ;;
  esac
  echo "$version $precision $hash" >>"$bullets/hashes.txt"
  echo "| $name | $row | $hash |"
}

# Only finds Bullet, and builds and runs a program with it.
find_case() {
  local kind=$1 build=$2 options=() version precision way
  IFS=- read -r version precision way <<<"$kind"
  case $kind in
    *-root) options=(-DLAZYCCD_BULLET_ROOT="$(bullet_prefix "$version-$precision")" -DPRECISIONS="$precision") ;;
    *-config) options=(-DCMAKE_PREFIX_PATH="$(bullet_prefix "$version-$precision")" -DPRECISIONS="$precision") ;;
    *-add_subdirectory | *-FetchContent)
      options=(-DWAY="$way" -DBULLET_SOURCE_DIR="$(bullet_source "$version")" -DPRECISIONS="$precision")
      [ "$precision" = double ] && options+=(-DUSE_DOUBLE_PRECISION=ON)
      ;;
    vcpkg | folders) options=(-DCMAKE_PREFIX_PATH="$(bullet_layout "$kind")" -DPRECISIONS=double) ;;
    conda | homebrew) options=(-DCMAKE_PREFIX_PATH="$(bullet_layout "$kind")" "-DPRECISIONS=float;double") ;;
    shared) options=(-DLAZYCCD_BULLET_ROOT="$(bullet_prefix 3.24-float-shared)" -DPRECISIONS=float) ;;
    threads) options=(-DCMAKE_PREFIX_PATH="$(bullet_prefix 3.26-double-shared-threads)" -DPRECISIONS=double) ;;
  esac
  rm -rf "$build"
  # Debian's Bullet is out of sight.
  PKG_CONFIG_LIBDIR=/nowhere cmake -S "$repository/tests/install/finds_bullet" -B "$build" "${compiler_options[@]}" \
    -DCMAKE_IGNORE_PREFIX_PATH='/usr;/' "${options[@]}" >"$build.txt" 2>&1
  cmake --build "$build" -j "$jobs" >>"$log" 2>&1
  ctest --test-dir "$build" >>"$log" 2>&1
  echo "| find-$kind | $(sed -n 's/^-- LazyCCD: Bullet /Bullet /p' "$build.txt" | sed "s|$bullets/||" | paste -sd ';') | programs run | |"
}

if [ "${1:-}" = --list ]; then
  printf '%s\n' "${cases[@]}"
  exit
fi
if [ "${1:-}" = --layouts ]; then
  layout_bullet=debian
  set -- find-debian-float-root find-debian-double-config find-vcpkg find-folders find-conda find-homebrew
fi
[ $# -gt 0 ] && cases=("$@") || rm -f "$bullets/hashes.txt"
require_packages core bullet programs tests
: >"$log"
status=0
for name in "${cases[@]}"; do
  set +e
  (set -e; run_case "$name")
  code=$?
  set -e
  [ $code = 0 ] || { echo "| $name | FAILED, see $log and the .txt files beside it | | |"; status=1; }
done
if [ -e "$bullets/hashes.txt" ] && [ "$(cut -d' ' -f2- "$bullets/hashes.txt" | sort -u | awk '{print $1}' | uniq -d | wc -l)" != 0 ]; then
  echo "The hashes of a precision differ:"
  sort -u "$bullets/hashes.txt"
  status=1
fi
exit $status
