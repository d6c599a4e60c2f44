# Shell functions that install packages and build on a fresh Debian 12 or Ubuntu 24.04. The scripts of
# examples/ and tests/ source this file.
#
#   require_packages GROUP...   installs the missing packages of the groups core, bullet, programs,
#                               tests, checks, python, pybullet, memory, pictures, web, browser; needs root only if a
#                               package is missing
#   build_preset PRESET [CMAKE OPTION...] [-- TARGET...]
#                               configures a preset and builds it in build/PRESET
#   build_wasm [-- TARGET...]   the same for the preset wasm, with Bullet's sources of the distribution

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
jobs=${JOBS:-$(nproc)}

say() { printf '\n== %s\n' "$*"; }

# Lists the packages of a group, one a line: the package, a colon, its purpose.
packages_of() {
  case $1 in
    core)
      echo 'g++: the compiler'
      echo 'cmake: the build, at least 3.24'
      echo 'ninja-build: the build'
      echo 'libboost-dev: headers of Multiprecision (exact stage) and Sort (order of contact rows)'
      echo 'libeigen3-dev: principal axes of oriented boxes; small dense systems in the adapter'
      ;;
    bullet)
      echo 'libbullet-dev: Bullet in both precisions'
      ;;
    programs)
      echo 'libcli11-dev: command lines'
      echo 'nlohmann-json3-dev: JSON files'
      echo 'libembree-dev: ray tracing, for pictures of scenes'
      echo 'libpng-dev: pictures'
      echo 'libwebp-dev: films'
      echo 'pkg-config: finds libwebp'
      ;;
    tests)
      echo 'catch2: the test framework'
      echo 'libflint-dev: algebraic numbers, for the exact oracle'
      echo 'libgmp-dev: big integers, for FLINT'
      echo 'spin: the model checker, for the balancing protocol'
      # Arb is a package of its own beside FLINT 2 and a part of FLINT 3.
      if grep -qs bookworm /etc/os-release; then
        echo 'libflint-arb-dev: ball arithmetic, for the exact oracle'
      fi
      ;;
    checks)
      echo 'clang: the second compiler'
      echo 'libclang-rt-dev: its sanitizers'
      echo 'clang-format: the layout of the sources'
      ;;
    python)
      echo 'python3-venv: a fresh virtual environment for the Python package'
      echo 'python3-dev: headers of Python, for the extension module'
      ;;
    pybullet)
      echo 'xvfb: a virtual display, for PyBullet in a window'
      ;;
    memory)
      echo 'valgrind: memory errors of the Python package'
      ;;
    web)
      echo 'emscripten: the compiler for WebAssembly'
      echo 'dpkg-dev: unpacks the sources of Bullet'
      echo 'libjs-three: draws the page'
      ;;
    browser)
      echo 'chromium: the browser that tests the page'
      echo 'chromium-driver: drives it'
      echo 'python3-selenium: drives it'
      echo 'node-typescript: checks the types of the package'
      ;;
    pictures)
      echo 'python3-matplotlib: charts, and pictures side by side'
      echo 'python3-pil: films side by side'
      ;;
  esac
}

is_installed() {
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

require_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not Debian or Ubuntu. Install the packages that third_party_notes.md lists by hand." >&2
    return 0
  fi
  local group package purpose missing=()
  list_missing() {
    missing=()
    for group in "$@"; do
      while IFS=: read -r package purpose; do
        is_installed "$package" && continue
        missing+=("$package")
        printf '  %-20s%s\n' "$package" "$purpose"
      done < <(packages_of "$group")
    done
  }
  list_missing "$@" >/dev/null
  [ ${#missing[@]} -eq 0 ] && return 0

  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      say "These packages are missing. Installing them needs root:"
      list_missing "$@"
      echo "  apt-get install ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  say "Updating the package lists"
  "${as_root[@]}" apt-get update -qq
  say "Installing the missing packages from the distribution:"
  list_missing "$@"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}"
}

build_preset() {
  local preset=$1 options=() targets=()
  shift
  while [ $# -gt 0 ] && [ "$1" != -- ]; do
    options+=("$1")
    shift
  done
  [ $# -gt 0 ] && shift && targets=(--target "$@")
  if command -v ccache >/dev/null; then
    export CCACHE_SLOPPINESS=pch_defines,time_macros
    options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  say "Building $preset in build/$preset"
  (cd "$repository" && cmake --preset "$preset" --log-level=WARNING "${options[@]}" &&
    cmake --build "build/$preset" -j "$jobs" "${targets[@]}")
}

# Unpacks the sources of the distribution's Bullet in build/bullet_sources, and sets bullet_sources to
# the folder. The system's own lists of packages stay as they are.
require_bullet_sources() {
  local folder=$repository/build/bullet_sources
  if ! compgen -G "$folder/bullet-*/src" >/dev/null; then
    say "Getting the sources of Bullet"
    mkdir -p "$folder/lists/partial"
    apt-get indextargets --format 'deb-src $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' \
      "Origin: $(. /etc/os-release && echo "${NAME%% *}")" | sort -u >"$folder/sources.list"
    (cd "$folder" &&
      options=(-qq -o "Dir::Etc::SourceList=$folder/sources.list" -o Dir::Etc::SourceParts=/dev/null
        -o "Dir::State::Lists=$folder/lists" -o APT::Sandbox::User=root) &&
      apt-get "${options[@]}" update && apt-get "${options[@]}" source bullet)
  fi
  bullet_sources=$(compgen -G "$folder/bullet-*/src")
}

build_wasm() {
  require_bullet_sources
  # The compiler keeps its own libraries, which it builds once.
  [ -w /usr/share/emscripten/cache ] || export EM_CACHE=$repository/build/emscripten_cache
  # Where Debian's compiler finds its optimizer of scripts.
  NODE_PATH=/usr/share/nodejs build_preset wasm -DLAZYCCD_BULLET_ROOT="$bullet_sources" "$@"
}
