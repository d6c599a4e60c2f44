# Libraries of headers alone, taken from the system that compiles. Their own CMake files would name
# /usr/include, where the headers of another C library are.
set(header_packages ${PROJECT_BINARY_DIR}/header_packages)

# lazyccd_header_package(PACKAGE TARGET PATH [LINE...])
# PATH: the header or the folder of headers in /usr/include. Each LINE is added to the package's file.
function(lazyccd_header_package package target path)
  find_path(found ${path} PATHS /usr/include NO_CACHE NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
  if(NOT found)
    return()
  endif()
  set(folder ${header_packages}/${package})
  cmake_path(GET path FILENAME name)
  file(MAKE_DIRECTORY ${folder}/include)
  file(CREATE_LINK ${found}/${path} ${folder}/include/${name} SYMBOLIC)
  list(JOIN ARGN "\n" lines)
  file(WRITE ${folder}/${package}Config.cmake "\
if(NOT TARGET ${target})
  add_library(${target} INTERFACE IMPORTED)
  target_include_directories(${target} SYSTEM INTERFACE ${folder}/include)
endif()
${lines}
")
  file(WRITE ${folder}/${package}ConfigVersion.cmake "set(PACKAGE_VERSION_COMPATIBLE TRUE)\n")
  set(${package}_DIR ${folder} CACHE PATH "" FORCE)
endfunction()

lazyccd_header_package(Boost Boost::headers boost)
lazyccd_header_package(Eigen3 Eigen3::Eigen eigen3/Eigen)
lazyccd_header_package(CLI11 CLI11::CLI11 CLI)
lazyccd_header_package(nlohmann_json nlohmann_json::nlohmann_json nlohmann)
find_path(LAZYCCD_CATCH_MODULES Catch.cmake PATHS /usr/lib/cmake/Catch2 /usr/share/cmake/Catch2
  NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
mark_as_advanced(LAZYCCD_CATCH_MODULES)
lazyccd_header_package(Catch2 Catch2::Catch2 catch2
  "list(APPEND CMAKE_MODULE_PATH ${LAZYCCD_CATCH_MODULES})")
