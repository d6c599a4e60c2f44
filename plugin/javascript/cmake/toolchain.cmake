# Emscripten's toolchain, wherever the compiler is installed.
find_program(LAZYCCD_EMCC emcc REQUIRED NO_CMAKE_FIND_ROOT_PATH)
mark_as_advanced(LAZYCCD_EMCC)
file(REAL_PATH ${LAZYCCD_EMCC} emcc)
cmake_path(GET emcc PARENT_PATH emscripten)
include(${emscripten}/cmake/Modules/Platform/Emscripten.cmake)
