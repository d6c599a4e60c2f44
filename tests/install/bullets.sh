# Shell functions that fetch Bullet's sources and build them in many ways. Scripts of this folder source this file.
#
#   bullet_source VERSION       fetches 3.24 (Debian's source package) or 3.26 (PyBullet's); prints the folder
#   bullet_prefix NAME          builds and installs VERSION-PRECISION[-shared][-threads]; prints the folder. VERSION
#                               debian takes the libraries of libbullet-dev
#   bullet_layout KIND          arranges installed libraries as KIND has them: vcpkg, conda, homebrew, folders;
#                               prints the folder. $layout_bullet is their version, else 3.24
#
# Everything is below build/install, and is kept. Nothing of Bullet is part of this repository.

bullets=$repository/build/install
log=$bullets/log.txt
mkdir -p "$bullets"

bullet_source() {
  local folder=$bullets/sources/bullet-$1
  if [ ! -e "$folder/.complete" ]; then
    rm -rf "$folder" && mkdir -p "$folder"
    case $1 in
      3.24) fetch_debian "$folder" ;;
      3.26) fetch_pybullet "$folder" ;;
    esac >>"$log" 2>&1
    touch "$folder/.complete"
  fi
  echo "$folder"
}

# Debian's source package, from where this machine has its packages, without changing what it knows.
fetch_debian() {
  local archive=$bullets/sources/debian lists=$bullets/sources/lists file
  mkdir -p "$archive/parts" "$lists/partial"
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
    [ -e "$file" ] && sed 's/^Types: deb$/Types: deb-src/; s/^deb /deb-src /' "$file" >"$archive/parts/$(basename "$file")"
  done
  local options=(-o Dir::Etc::sourcelist=- -o Dir::Etc::sourceparts="$archive/parts" -o Dir::State::lists="$lists")
  apt-get "${options[@]}" update -qq
  (cd "$archive" && apt-get "${options[@]}" source --download-only bullet)
  tar xf "$archive"/bullet_3.24*.orig.tar.xz -C "$1" --strip-components 1
}

# The package of PyBullet 3.2.7 holds the sources of Bullet 3.26 without the CMake files of src/. Those
# of 3.24 are put there, for the ways that need them.
fetch_pybullet() {
  local archive=$bullets/sources/pybullet older
  older=$(bullet_source 3.24)
  mkdir -p "$archive"
  pip download --quiet --no-binary pybullet --no-deps -d "$archive" pybullet==3.2.7
  tar xf "$archive"/pybullet-3.2.7.tar.gz -C "$1" --strip-components 1
  (cd "$older" && tar cf - CMakeLists.txt ./*.in ./*.cmake VERSION $(find src -name CMakeLists.txt)) | tar xf - -C "$1"
  echo 3.26 >"$1/VERSION"
}

compiler_options=(-G Ninja -DCMAKE_BUILD_TYPE=Release)
if command -v ccache >/dev/null; then
  export CCACHE_SLOPPINESS=pch_defines,time_macros
  compiler_options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache)
fi

# Debian's libraries of one precision, as if they had been installed to a folder of their own.
debian_prefix() {
  local suffix='' libraries library
  case $1 in *-double) suffix=-float64 ;; esac
  libraries=$(pkg-config --variable=libdir bullet)
  mkdir -p "$2/include" "$2/lib/cmake/bullet"
  cp -r /usr/include/bullet "$2/include"
  for library in LinearMath BulletCollision BulletDynamics BulletSoftBody; do
    cp "$libraries/lib$library$suffix.so" "$2/lib/lib$library.so"
  done
  sed -E '/BULLET_LIBRARIES/s/-float64//g' "$libraries/cmake/bullet/BulletConfig$suffix.cmake" \
    >"$2/lib/cmake/bullet/BulletConfig.cmake"
}

bullet_prefix() {
  local name=$1 prefix=$bullets/prefix/$1 options=()
  case $name in debian-*) [ -e "$prefix" ] || debian_prefix "$name" "$prefix" ;; esac
  if [ ! -e "$prefix/.complete" ] && [ ! -e "$prefix/include/bullet" ]; then
    case $name in *-double*) options+=(-DUSE_DOUBLE_PRECISION=ON) ;; esac
    case $name in *-shared*) options+=(-DBUILD_SHARED_LIBS=ON) ;; esac
    case $name in *-threads*) options+=(-DBULLET2_MULTITHREADING=ON) ;; esac
    case $name in *-debug*) options+=(-DCMAKE_BUILD_TYPE=Debug -DCMAKE_DEBUG_POSTFIX=_Debug) ;; esac
    for part in CPU_DEMOS BULLET2_DEMOS OPENGL3_DEMOS EXTRAS UNIT_TESTS BULLET3; do options+=(-DBUILD_$part=OFF); done
    {
      rm -rf "$prefix"
      cmake -S "$(bullet_source "${name%%-*}")" -B "$bullets/bullet/$name" "${compiler_options[@]}" \
        -DCMAKE_INSTALL_PREFIX="$prefix" -DINSTALL_LIBS=ON -DCMAKE_POLICY_VERSION_MINIMUM=3.5 \
        -DCMAKE_CXX_FLAGS=-w "${options[@]}" &&
        cmake --build "$bullets/bullet/$name" -j "$jobs" --target install && touch "$prefix/.complete"
    } >>"$log" 2>&1
  fi
  echo "$prefix"
}

# imported_targets ENDING: a config file as vcpkg patches it, for libraries with this ending
imported_targets() {
  local library
  echo 'get_filename_component(prefix "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)'
  for library in LinearMath BulletCollision BulletDynamics BulletSoftBody; do
    echo "add_library($library STATIC IMPORTED)"
    echo "set_target_properties($library PROPERTIES IMPORTED_LOCATION \${prefix}/lib/lib$library$1" \
      "INTERFACE_INCLUDE_DIRECTORIES \${prefix}/include/bullet)"
  done
  echo 'set(BULLET_FOUND 1)'
  echo 'set(BULLET_DEFINITIONS "-DBT_USE_DOUBLE_PRECISION")'
}

# The folders as the package manager lays them out, with what is wrong in the config files there.
bullet_layout() {
  local folder=$bullets/layout/$1 float double ending=.a
  float=$(bullet_prefix "${layout_bullet:-3.24}-float") double=$(bullet_prefix "${layout_bullet:-3.24}-double")
  [ -e "$double/lib/libLinearMath.a" ] || ending=.so
  rm -rf "$folder" && mkdir -p "$folder"
  case $1 in
    folders) # no config file; debug libraries in a folder of their own
      cp -r "$double/include" "$folder"
      mkdir -p "$folder/lib" "$folder/debug/lib"
      cp "$double"/lib/*$ending "$folder/lib"
      for file in "$double"/lib/*$ending; do
        cp "$file" "$folder/debug/lib/$(basename "$file" $ending)_Debug$ending"
      done
      ;;
    vcpkg) # one precision, imported targets
      mkdir -p "$folder/share/bullet3" "$folder/lib"
      cp -r "$double/include" "$folder"
      cp "$double"/lib/*$ending "$folder/lib"
      imported_targets $ending >"$folder/share/bullet3/BulletConfig.cmake"
      ;;
    conda) # both precisions side by side, two config files
      cp -r "$float/." "$folder"
      for file in "$double"/lib/*$ending; do
        cp "$file" "$folder/lib/$(basename "$file" $ending)-float64$ending"
      done
      sed -E '/BULLET_LIBRARIES/s/([A-Za-z0-9]+)(;|")/\1-float64\2/g' "$double/lib/cmake/bullet/BulletConfig.cmake" \
        >"$folder/lib/cmake/bullet/BulletConfig-float64.cmake"
      ;;
    homebrew) # double in a folder below lib, with a config file that says otherwise
      cp -r "$float/." "$folder"
      mkdir -p "$folder/lib/bullet"
      cp -r "$double/lib" "$folder/lib/bullet/double"
      ;;
  esac >&2
  # The packages were not built for this folder.
  sed -i -E 's|(BULLET_ROOT_DIR +)".*"|\1"/nowhere"|' $(find "$folder" -name 'BulletConfig*.cmake') /dev/null 2>/dev/null || true
  echo "$folder"
}
