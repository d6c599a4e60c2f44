# Candidates for Bullet, and the check that decides which precision one has.

# Sets OUT to the wanted precisions that were not found yet.
function(lazyccd_bullet_missing out)
  set(missing "")
  foreach(precision IN LISTS lazyccd_bullet_wanted)
    if(NOT TARGET LazyCCDBullet::${precision})
      list(APPEND missing ${precision})
    endif()
  endforeach()
  set(${out} "${missing}" PARENT_SCOPE)
endfunction()

# Adds a line to what is said if Bullet is not found.
function(lazyccd_bullet_note line)
  string(REPLACE ";" "," line "${line}")
  set_property(GLOBAL APPEND PROPERTY lazyccd_bullet_report "${line}")
endfunction()

# Sets OUT to whether bullet_check.cpp compiles and links in a precision, and ERROR to the first error.
# COMPILE_ONLY is for targets that are not built yet. The answer is remembered as long as the arguments
# are the same.
function(lazyccd_bullet_compiles out error precision)
  cmake_parse_arguments(PARSE_ARGV 3 arg "COMPILE_ONLY" "" "INCLUDES;DEFINITIONS;LIBRARIES")
  string(COMPARE EQUAL ${precision} double is_double)
  set(definitions -DLAZYCCD_EXPECTS_DOUBLE=${is_double})
  foreach(definition IN LISTS arg_DEFINITIONS)
    list(APPEND definitions -D${definition})
  endforeach()
  if(arg_COMPILE_ONLY)
    set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
    set(arg_LIBRARIES "")
  endif()
  string(SHA1 key "${ARGV};${CMAKE_CXX_COMPILER};${CMAKE_CXX_FLAGS}")
  string(SUBSTRING ${key} 0 12 key)
  set(answer LAZYCCD_BULLET_CHECK_${key})
  if(NOT DEFINED ${answer})
    try_compile(${answer} ${CMAKE_BINARY_DIR}/CMakeFiles/${answer}
      ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/bullet_check.cpp
      CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${arg_INCLUDES}"
      COMPILE_DEFINITIONS ${definitions}
      LINK_LIBRARIES ${arg_LIBRARIES}
      CXX_STANDARD 17 CXX_STANDARD_REQUIRED ON OUTPUT_VARIABLE output)
    string(REGEX MATCH "[^\n]*(error|undefined)[^\n]*" first "${output}")
    set(${answer}_ERROR "${first}" CACHE INTERNAL "")
  endif()
  set(${out} ${${answer}} PARENT_SCOPE)
  set(${error} "${${answer}_ERROR}" PARENT_SCOPE)
endfunction()

# Sets OUT to the version in Bullet's headers: 324 is 3.24.
function(lazyccd_bullet_version out)
  set(version unknown)
  foreach(folder IN LISTS ARGN)
    if(EXISTS ${folder}/LinearMath/btScalar.h)
      file(STRINGS ${folder}/LinearMath/btScalar.h line REGEX "define +BT_BULLET_VERSION +[0-9]+")
      if(line MATCHES "([0-9]+)([0-9][0-9])")
        set(version "${CMAKE_MATCH_1}.${CMAKE_MATCH_2}")
      endif()
      break()
    endif()
  endforeach()
  set(${out} ${version} PARENT_SCOPE)
endfunction()

# Makes the target of a precision. NAME tells where Bullet was found.
function(lazyccd_bullet_accept precision name)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "INCLUDES;DEFINITIONS;LIBRARIES")
  lazyccd_bullet_version(version ${arg_INCLUDES})
  set(target LazyCCDBullet::${precision})
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES lazyccd_version ${version})
  target_include_directories(${target} SYSTEM INTERFACE ${arg_INCLUDES})
  target_compile_definitions(${target} INTERFACE ${arg_DEFINITIONS})
  target_link_libraries(${target} INTERFACE ${arg_LIBRARIES})
  if(NOT LazyCCDBullet_FIND_QUIETLY)
    message(STATUS "LazyCCD: Bullet ${version} in ${precision}, by ${name}")
  endif()
endfunction()

# Offers a candidate: its name in messages, include folders, definitions without -D, and libraries in
# the order of linking. Its precision is accepted if it is wanted and was not found before.
function(lazyccd_bullet_offer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COMPILE_ONLY" "" "INCLUDES;DEFINITIONS;LIBRARIES;DEBUG_LIBRARIES")
  set(only "")
  if(arg_COMPILE_ONLY)
    set(only COMPILE_ONLY)
  endif()
  list(APPEND arg_LIBRARIES Threads::Threads)
  list(REMOVE_DUPLICATES arg_INCLUDES)
  set(found "")
  foreach(precision IN ITEMS float double)
    set(definitions ${arg_DEFINITIONS})
    # Libraries in double do not always come with the definition. Targets that lack it are in float.
    if(precision STREQUAL double AND NOT arg_COMPILE_ONLY)
      list(APPEND definitions BT_USE_DOUBLE_PRECISION)
    endif()
    list(REMOVE_DUPLICATES definitions)
    lazyccd_bullet_compiles(compiles error_${precision} ${precision} ${only} INCLUDES ${arg_INCLUDES}
      DEFINITIONS ${definitions} LIBRARIES ${arg_LIBRARIES})
    if(compiles)
      set(found ${precision})
      break()
    endif()
  endforeach()
  lazyccd_bullet_version(version ${arg_INCLUDES})
  if(NOT found)
    lazyccd_bullet_note("${name}: Bullet ${version}, but a program does not compile and link with it\n\
float: ${error_float}\n double: ${error_double}")
    return()
  endif()
  lazyccd_bullet_note("${name}: Bullet ${version} in ${found}")
  lazyccd_bullet_missing(missing)
  if(found IN_LIST missing)
    if(arg_DEBUG_LIBRARIES)
      set(arg_LIBRARIES "$<$<NOT:$<CONFIG:Debug>>:${arg_LIBRARIES}>"
        "$<$<CONFIG:Debug>:${arg_DEBUG_LIBRARIES}>" Threads::Threads)
    endif()
    lazyccd_bullet_accept(${found} "${name}" INCLUDES ${arg_INCLUDES} DEFINITIONS ${definitions}
      LIBRARIES ${arg_LIBRARIES})
  endif()
endfunction()
