# Adds the sources in BULLET_SOURCE_DIR to the project by WAY: add_subdirectory or FetchContent.

# Bullet without its demos, extras and tests. Its CMakeLists.txt is older than CMake 4 accepts.
foreach(part IN ITEMS CPU_DEMOS BULLET2_DEMOS OPENGL3_DEMOS EXTRAS UNIT_TESTS BULLET3)
  set(BUILD_${part} OFF CACHE BOOL "")
endforeach()
set(CMAKE_POLICY_VERSION_MINIMUM 3.5)

if(WAY STREQUAL "FetchContent")
  include(FetchContent)
  # A real project names an address and a hash here.
  FetchContent_Declare(bullet3 SOURCE_DIR ${BULLET_SOURCE_DIR})
  FetchContent_MakeAvailable(bullet3)
else()
  add_subdirectory(${BULLET_SOURCE_DIR} bullet3 EXCLUDE_FROM_ALL)
endif()
