# Finds the sources of the PyBullet that the plugin library is for. Sets pybullet_source to the folder of
# the unpacked source distribution, which has src/ (Bullet) and examples/ (the plugin interface).
#
# LAZYCCD_PYBULLET_SDIST names the folder or the archive. If it is empty, pip downloads the archive.
set(pybullet_version 3.2.7)

function(lazyccd_unpack_pybullet archive)
  message(STATUS "LazyCCD: unpacking ${archive}")
  file(ARCHIVE_EXTRACT INPUT ${archive} DESTINATION ${CMAKE_CURRENT_BINARY_DIR}/sdist
    PATTERNS "*/src/*" "*/examples/CommonInterfaces/*" "*/examples/SharedMemory/*.h" "*/PKG-INFO")
endfunction()

if(IS_DIRECTORY "${LAZYCCD_PYBULLET_SDIST}")
  set(pybullet_source ${LAZYCCD_PYBULLET_SDIST})
else()
  set(pybullet_source ${CMAKE_CURRENT_BINARY_DIR}/sdist/pybullet-${pybullet_version})
  if(NOT EXISTS ${pybullet_source}/src)
    set(archive ${LAZYCCD_PYBULLET_SDIST})
    if(NOT archive)
      find_package(Python COMPONENTS Interpreter REQUIRED)
      message(STATUS "LazyCCD: downloading the sources of PyBullet ${pybullet_version}, 80 MB")
      execute_process(
        COMMAND ${Python_EXECUTABLE} -m pip download --quiet --no-deps --no-binary pybullet
          --dest ${CMAKE_CURRENT_BINARY_DIR} pybullet==${pybullet_version}
        RESULT_VARIABLE failed)
      set(archive ${CMAKE_CURRENT_BINARY_DIR}/pybullet-${pybullet_version}.tar.gz)
      if(failed OR NOT EXISTS ${archive})
        message(FATAL_ERROR "pip could not download PyBullet's sources. Name them by "
          "LAZYCCD_PYBULLET_SDIST, or set LAZYCCD_PYBULLET to OFF for the detector alone")
      endif()
    endif()
    lazyccd_unpack_pybullet(${archive})
  endif()
endif()

if(NOT EXISTS ${pybullet_source}/src/BulletSoftBody/btSoftBody.h)
  message(FATAL_ERROR "${pybullet_source} is not PyBullet's source distribution")
endif()
file(STRINGS ${pybullet_source}/PKG-INFO found_version REGEX "^Version: ")
if(NOT found_version STREQUAL "Version: ${pybullet_version}")
  message(FATAL_ERROR "${pybullet_source}: PyBullet ${pybullet_version} is needed, found '${found_version}'")
endif()
