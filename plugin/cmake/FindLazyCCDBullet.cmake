# Finds Bullet however it was installed, in single and double precision. For each precision that is
# found it makes an imported target, LazyCCDBullet::float or LazyCCDBullet::double.
#
# The places, in this order; the first that has a precision provides it:
#   1. targets of the project: add_subdirectory(bullet3), FetchContent, an earlier find_package(Bullet)
#   2. LAZYCCD_BULLET_ROOT: a list of folders; each is where Bullet was installed, or Bullet's sources
#   3. BulletConfig.cmake
#   4. headers and libraries in the folders that CMake looks in, and in those of vcpkg and conda
#   5. pkg-config
# If the first or the second place has one precision, the other one is not looked for elsewhere.
#
# Components: float, double. Without components both are optional, and one of them is enough.
# Results: LazyCCDBullet_FOUND, LazyCCDBullet_PRECISIONS (the precisions found), and
# LazyCCDBullet_VERSION.
#
# The precision is decided by a test program that has to compile and link, never by a name.
find_package(Threads QUIET)
include(${CMAKE_CURRENT_LIST_DIR}/bullet_candidates.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/bullet_places.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/bullet_sources.cmake)

set(LAZYCCD_BULLET_ROOT "" CACHE STRING
  "Where Bullet is: folders that it was installed to, or folders of its sources")
set(LAZYCCD_BULLET_DEFINITIONS "" CACHE STRING
  "Definitions to compile Bullet's sources with, e.g. BT_THREADSAFE=1")

set(lazyccd_bullet_wanted ${LazyCCDBullet_FIND_COMPONENTS})
if(NOT lazyccd_bullet_wanted)
  set(lazyccd_bullet_wanted float double)
endif()
set_property(GLOBAL PROPERTY lazyccd_bullet_report "")
foreach(lazyccd_place IN ITEMS targets root config folders pkg_config)
  lazyccd_bullet_missing(lazyccd_missing)
  if(lazyccd_missing)
    cmake_language(CALL lazyccd_bullet_from_${lazyccd_place})
  endif()
  # What the project or the user names is not completed by another Bullet.
  if(lazyccd_place MATCHES "^(targets|root)$"
     AND (TARGET LazyCCDBullet::float OR TARGET LazyCCDBullet::double))
    break()
  endif()
endforeach()

set(LazyCCDBullet_PRECISIONS "")
foreach(lazyccd_precision IN LISTS lazyccd_bullet_wanted)
  set(LazyCCDBullet_${lazyccd_precision}_FOUND FALSE)
  if(TARGET LazyCCDBullet::${lazyccd_precision})
    set(LazyCCDBullet_${lazyccd_precision}_FOUND TRUE)
    list(APPEND LazyCCDBullet_PRECISIONS ${lazyccd_precision})
    get_target_property(LazyCCDBullet_VERSION LazyCCDBullet::${lazyccd_precision} lazyccd_version)
  endif()
endforeach()

get_property(lazyccd_report GLOBAL PROPERTY lazyccd_bullet_report)
list(JOIN lazyccd_report "\n  " lazyccd_report)
list(JOIN lazyccd_bullet_wanted " or " lazyccd_wanted)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LazyCCDBullet
  REQUIRED_VARS LazyCCDBullet_PRECISIONS VERSION_VAR LazyCCDBullet_VERSION HANDLE_COMPONENTS
  REASON_FAILURE_MESSAGE "Bullet in ${lazyccd_wanted} was looked for here:\n  ${lazyccd_report}\n\
Set LAZYCCD_BULLET_ROOT to the folder where Bullet was installed, or to the folder of its sources.")
