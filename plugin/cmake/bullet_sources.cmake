# Builds Bullet's libraries from its sources, for each precision that is still wanted. The sources in
# PyBullet's package have no CMake files of their own; so the files are listed here by their folders.

function(lazyccd_bullet_offer_sources folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${folder}/LinearMath/*.cpp ${folder}/BulletCollision/*.cpp
    ${folder}/BulletDynamics/*.cpp ${folder}/BulletSoftBody/*.cpp)
  lazyccd_bullet_missing(missing)
  foreach(precision IN LISTS missing)
    set(definitions "")
    if(precision STREQUAL double)
      set(definitions BT_USE_DOUBLE_PRECISION)
    endif()
    set(target lazyccd_bullet3_${precision})
    add_library(${target} STATIC EXCLUDE_FROM_ALL ${sources})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_STANDARD 17
      CXX_VISIBILITY_PRESET default)
    target_include_directories(${target} SYSTEM PRIVATE ${folder})
    target_compile_definitions(${target} PRIVATE ${definitions} ${LAZYCCD_BULLET_DEFINITIONS})
    # Bullet's warnings are not for users of LazyCCD. Without contraction its bits are the same on all
    # processors.
    if(MSVC)
      target_compile_options(${target} PRIVATE /w /fp:precise)
    else()
      # -fno-ipa-ra: see lazyccd_target() of CMakeLists.txt.
      target_compile_options(${target} PRIVATE -w -ffp-contract=off
        $<$<AND:$<BOOL:${MINGW}>,$<CXX_COMPILER_ID:GNU>>:-fno-ipa-ra>)
    endif()
    lazyccd_bullet_offer("the sources in ${folder}" COMPILE_ONLY INCLUDES ${folder}
      DEFINITIONS ${definitions} LIBRARIES ${target})
  endforeach()
endfunction()
