# Dependencies go plugin -> cuda/include -> cuda/detector.cpp, the body of the public interface, ->
# cuda/gpu -> cuda/cpu -> {cuda/balance, cuda/core}; Bullet's headers only in plugin/ and examples/,
# CUDA's only in cuda/gpu and cuda/balance. The device leaves to the host what only exact arithmetic
# decides, so gpu/ knows cpu/, and never the other way round.
cmake_minimum_required(VERSION 3.24)

set(bullet "^(btBulletC|btBulletD|BulletS|BulletC|BulletD|LinearMath/)")
set(device "^(cuda|cub/|thrust/|nv/)")
set(failures 0)

# Every #include of the sources under `folder` must match none of the patterns after FORBID; an include
# in quotes must match the pattern after QUOTED.
function(check folder)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "QUOTED" "FORBID")
  file(GLOB_RECURSE sources ${source_dir}/${folder}/*.h ${source_dir}/${folder}/*.cpp
    ${source_dir}/${folder}/*.cu ${source_dir}/${folder}/*.cuh)
  foreach(source IN LISTS sources)
    file(STRINGS ${source} lines REGEX "^[ \t]*#[ \t]*include")
    foreach(line IN LISTS lines)
      if(NOT line MATCHES "include[ \t]*([<\"])([^>\"]+)[>\"]")
        continue()
      endif()
      set(quote "${CMAKE_MATCH_1}")
      set(name "${CMAKE_MATCH_2}")
      set(wrong FALSE)
      if(quote STREQUAL "\"" AND DEFINED arg_QUOTED AND NOT name MATCHES "${arg_QUOTED}")
        set(wrong TRUE)
      endif()
      foreach(pattern IN LISTS arg_FORBID)
        if(name MATCHES "${pattern}")
          set(wrong TRUE)
        endif()
      endforeach()
      if(wrong)
        message("${source}: must not include ${name}")
        math(EXPR failures "${failures} + 1")
      endif()
    endforeach()
  endforeach()
  set(failures ${failures} PARENT_SCOPE)
endfunction()

check(cuda/include QUOTED "^lazyccd/" FORBID ${bullet} ${device})
check(cuda/core QUOTED "^(core|lazyccd)/" FORBID ${bullet} ${device})
check(cuda/balance QUOTED "^(balance|core)/" FORBID ${bullet})
check(cuda/cpu QUOTED "^(cpu|balance|core|lazyccd)/" FORBID ${bullet} ${device})
check(cuda/gpu QUOTED "^(gpu|cpu|balance|core|lazyccd)/" FORBID ${bullet})
check(plugin FORBID "^(core|cpu|gpu|balance|io|scenes)/" ${device})
check(examples/io QUOTED "^(io|lazyccd)/" FORBID "^lazyccd/bullet/" ${bullet} ${device})
check(examples/scenes FORBID "^(core|cpu|gpu|balance)/" ${device})
check(examples/cli FORBID "^(core|cpu|gpu|balance)/" ${device})

if(failures GREATER 0)
  message(FATAL_ERROR "${failures} includes go the wrong way")
endif()
