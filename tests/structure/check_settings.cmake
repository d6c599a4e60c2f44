# Fails if plugin/ has a named number that changes the motion outside of plugin/settings.h: a constant of
# floating point that is no setting and does not say `cost` or `rounding` on its line.
#
#   cmake -D source_dir=. -P tests/structure/check_settings.cmake
cmake_minimum_required(VERSION 3.24)

set(failures 0)
file(GLOB_RECURSE sources ${source_dir}/plugin/*.h ${source_dir}/plugin/*.cpp)
list(FILTER sources EXCLUDE REGEX "/plugin/(python/|packages/|cmake/|settings\\.h$)")
foreach(source IN LISTS sources)
  file(STRINGS ${source} lines REGEX "constexpr (float|double|btScalar) [^(]*[0-9]")
  foreach(line IN LISTS lines)
    if(NOT line MATCHES "settings::|cost|rounding| pi = ")
      message("${source}: belongs to plugin/settings.h: ${line}")
      math(EXPR failures "${failures} + 1")
    endif()
  endforeach()
endforeach()

if(failures GREATER 0)
  message(FATAL_ERROR "${failures} failures")
endif()
