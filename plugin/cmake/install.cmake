# What `cmake --install` installs: component "runtime" (shared libraries) and component "dev" (headers,
# static libraries, CMake and pkg-config files). `cpack` makes packages of them.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/LazyCCD)
set(libraries lazyccd_core lazyccd_research)
foreach(precision IN LISTS LAZYCCD_PRECISIONS)
  list(APPEND libraries lazyccd_bullet${lazyccd_suffix_${precision}})
endforeach()

install(TARGETS ${libraries} EXPORT LazyCCDTargets
  RUNTIME COMPONENT runtime
  LIBRARY COMPONENT runtime NAMELINK_COMPONENT dev
  ARCHIVE COMPONENT dev)
install(DIRECTORY cuda/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
if(LAZYCCD_BULLET)
  install(DIRECTORY plugin/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
  install(DIRECTORY plugin/cmake/ DESTINATION ${package_dir} COMPONENT dev
    FILES_MATCHING PATTERN FindLazyCCDBullet.cmake PATTERN bullet_*)
endif()
install(EXPORT LazyCCDTargets NAMESPACE LazyCCD:: DESTINATION ${package_dir} COMPONENT dev)
# The CUDA runtime is inside of shared libraries.
set(config_needs_cuda OFF)
if(LAZYCCD_CUDA AND NOT BUILD_SHARED_LIBS)
  set(config_needs_cuda ON)
endif()
configure_package_config_file(cuda/LazyCCDConfig.cmake.in ${PROJECT_BINARY_DIR}/LazyCCDConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/LazyCCDConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/LazyCCDConfig.cmake ${PROJECT_BINARY_DIR}/LazyCCDConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT dev)
install(FILES LICENSE third_party_notes.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev)

# Writes a module for pkg-config. Paths of LazyCCD are relative to the file, so that folders may be moved.
function(lazyccd_pkg_config_module name description)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "LIBRARY;REQUIRES" "CFLAGS;LIBS;PRIVATE_LIBS")
  if(BUILD_SHARED_LIBS)
    list(APPEND arg_CFLAGS -DLAZYCCD_SHARED)
  else()
    list(APPEND arg_LIBS ${arg_PRIVATE_LIBS})
    set(arg_PRIVATE_LIBS "")
  endif()
  file(RELATIVE_PATH up ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
  list(JOIN arg_CFLAGS " " cflags)
  list(JOIN arg_LIBS " " libs)
  list(JOIN arg_PRIVATE_LIBS " " private_libs)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/${name}.pc CONTENT "prefix=\${pcfiledir}/${up}
libdir=\${prefix}/${CMAKE_INSTALL_LIBDIR}
includedir=\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}

Name: ${name}
Description: ${description}
Version: ${PROJECT_VERSION}
Requires: ${arg_REQUIRES}
Cflags: -I\${includedir} ${cflags}
Libs: -L\${libdir} -l${arg_LIBRARY} ${libs}
Libs.private: ${private_libs}
")
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endfunction()

# Sets OUT to the packages of Debian that files belong to; nothing for files of no package.
find_program(LAZYCCD_DPKG_QUERY dpkg-query)
mark_as_advanced(LAZYCCD_DPKG_QUERY)
function(lazyccd_debian_packages out)
  set(packages "")
  foreach(file IN LISTS ARGN)
    if(LAZYCCD_DPKG_QUERY)
      execute_process(COMMAND ${LAZYCCD_DPKG_QUERY} --search ${file} OUTPUT_VARIABLE owner ERROR_QUIET)
      if(owner MATCHES "^([a-z0-9.+-]+)[:,]")
        list(APPEND packages ${CMAKE_MATCH_1})
      endif()
    endif()
  endforeach()
  list(REMOVE_DUPLICATES packages)
  set(${out} ${packages} PARENT_SCOPE)
endfunction()

# The compiler's C++ library is linked by the C++ compiler.
set(core_libs ${CMAKE_THREAD_LIBS_INIT})
if(LAZYCCD_CUDA)
  list(APPEND core_libs -L${CUDAToolkit_LIBRARY_DIR} -lcudart_static -ldl -lrt)
endif()
lazyccd_pkg_config_module(lazyccd "Exact continuous collision detection" LIBRARY lazyccd_core
  PRIVATE_LIBS ${core_libs})
lazyccd_pkg_config_module(lazyccd-research "Strategies, volumes and culling for LazyCCD" LIBRARY lazyccd_research
  REQUIRES lazyccd)
set(packages_of_bullet "")
foreach(precision IN LISTS LAZYCCD_PRECISIONS)
  get_target_property(bullet_libraries LazyCCDBullet::${precision} INTERFACE_LINK_LIBRARIES)
  list(FILTER bullet_libraries INCLUDE REGEX "^/|^[A-Za-z]:/")
  lazyccd_debian_packages(packages ${bullet_libraries})
  list(APPEND packages_of_bullet ${packages})
  list(REMOVE_DUPLICATES packages_of_bullet)
  # Targets have no file to name before they are built.
  if(bullet_libraries)
    get_target_property(folders LazyCCDBullet::${precision} INTERFACE_INCLUDE_DIRECTORIES)
    get_target_property(definitions LazyCCDBullet::${precision} INTERFACE_COMPILE_DEFINITIONS)
    list(TRANSFORM folders PREPEND -I)
    string(COMPARE EQUAL ${precision} double is_double)
    set(cflags ${folders} -DLAZYCCD_BULLET_DOUBLE=${is_double})
    if(definitions)
      list(TRANSFORM definitions PREPEND -D)
      list(APPEND cflags ${definitions})
    endif()
    string(REPLACE _ - dashed "${lazyccd_suffix_${precision}}")
    lazyccd_pkg_config_module(lazyccd-bullet${dashed} "LazyCCD for Bullet in ${precision}"
      LIBRARY lazyccd_bullet${lazyccd_suffix_${precision}} REQUIRES lazyccd
      CFLAGS ${cflags} LIBS ${bullet_libraries})
  endif()
endforeach()

# Packages. The shared libraries are in one, all else in the other.
set(CPACK_PACKAGE_NAME lazyccd)
set(CPACK_PACKAGE_VENDOR LazyCCD)
set(CPACK_PACKAGE_CONTACT "the authors of LazyCCD")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_GENERATOR TGZ)
set(CPACK_COMPONENTS_ALL dev)
if(BUILD_SHARED_LIBS)
  set(CPACK_COMPONENTS_ALL runtime dev)
  set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "liblazyccd${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} (= ${PROJECT_VERSION})")
endif()
list(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ${packages_of_bullet})
list(JOIN CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME liblazyccd${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME liblazyccd-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
if(PROJECT_IS_TOP_LEVEL)
  include(CPack)
endif()
