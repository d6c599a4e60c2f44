# Fails if an include points the wrong way, or if a folder holds too many modules.
#
#   cmake -D source_dir=. -P tests/structure/check_includes.cmake
#
# Projects, from the top: plugin -> cuda/include -> cuda/detector.cpp -> cuda/gpu -> cuda/cpu -> cuda/host ->
# {cuda/balance, cuda/core} -> cuda/simd, which plugin/ shares. The GPU leaves rare queries to the CPU's exact arithmetic, so gpu/ knows
# cpu/, never the other way round. cuda/research stands above both backends, and nothing but programs
# knows it. Bullet's headers are only in plugin/ and examples/, CUDA's only in cuda/gpu, cuda/research and
# cuda/balance. The folders of plugin/, cuda/host, cuda/cpu, cuda/gpu and cuda/research form the layers below.
cmake_minimum_required(VERSION 3.24)

set(bullet "^(btBulletC|btBulletD|BulletS|BulletC|BulletD|LinearMath/)")
set(device "^(cuda|cub/|thrust/|nv/)")
set(failures 0)

function(fail text)
  message("${text}")
  math(EXPR count "${failures} + 1")
  set(failures ${count} PARENT_SCOPE)
endfunction()

# Every include of the sources in and below `folder` must match none of the patterns after FORBID.
# An include in quotes must match the pattern after QUOTED. FLAT: without the folders below.
function(check folder)
  cmake_parse_arguments(PARSE_ARGV 1 arg "FLAT" "QUOTED" "FORBID")
  set(glob GLOB_RECURSE)
  if(arg_FLAT)
    set(glob GLOB)
  endif()
  file(${glob} sources ${source_dir}/${folder}/*.h ${source_dir}/${folder}/*.cpp
    ${source_dir}/${folder}/*.cu ${source_dir}/${folder}/*.cuh)
  if(NOT sources)
    fail("${folder}: there are no sources to check")
  endif()
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
        fail("${source}: must not include ${name}")
      endif()
    endforeach()
  endforeach()
  set(failures ${failures} PARENT_SCOPE)
endfunction()

# Layers of `root`, lowest first. Each may include itself, the layers given for it, and `always`.
function(check_layers root always)
  foreach(layer IN LISTS ARGN)
    string(REPLACE ":" ";" parts "${layer}")
    list(GET parts 0 name)
    list(GET parts 1 below)
    string(REPLACE "," "|" below "${name},${below}")
    string(REGEX REPLACE "\\|$" "" below "${below}")
    check(${root}/${name} QUOTED "^(${always}|${prefix}(${below})/)")
  endforeach()
  set(failures ${failures} PARENT_SCOPE)
endfunction()

# A header and its sources count as one module.
function(check_size most)
  foreach(folder IN LISTS ARGN)
    file(GLOB_RECURSE entries LIST_DIRECTORIES true ${source_dir}/${folder}/*)
    foreach(directory IN LISTS entries ITEMS ${source_dir}/${folder})
      if(NOT IS_DIRECTORY ${directory})
        continue()
      endif()
      file(GLOB files LIST_DIRECTORIES false ${directory}/*.h ${directory}/*.cpp ${directory}/*.cu
        ${directory}/*.cuh)
      list(TRANSFORM files REPLACE "\\.[a-z]+$" "")
      list(REMOVE_DUPLICATES files)
      list(LENGTH files count)
      if(count GREATER most)
        fail("${directory}: ${count} modules in one folder; ${most} are the most")
      endif()
    endforeach()
  endforeach()
  set(failures ${failures} PARENT_SCOPE)
endfunction()

check(cuda/include QUOTED "^lazyccd/" FORBID ${bullet} ${device})
check(cuda/simd QUOTED "^simd/" FORBID ${bullet} ${device})
check(cuda/core QUOTED "^(core|lazyccd)/" FORBID ${bullet} ${device})
check(cuda/balance QUOTED "^(balance|core)/" FORBID ${bullet})
check(cuda/host QUOTED "^(host|core|simd|lazyccd)/" FORBID ${bullet} ${device})
check(cuda/cpu QUOTED "^(cpu|host|balance|core|simd|lazyccd)/" FORBID ${bullet} ${device})
check(cuda/gpu QUOTED "^(gpu|cpu|host|balance|core|lazyccd)/" FORBID ${bullet})
check(cuda/research QUOTED "^(research|gpu|cpu|host|balance|core|lazyccd)/" FORBID ${bullet})
check(cuda FLAT FORBID "^research/" ${bullet} ${device})
check(plugin FORBID "^(core|host|cpu|gpu|balance|research|io|scenes)/" ${device})
check(examples/io QUOTED "^(io|lazyccd)/" FORBID "^lazyccd/bullet/" ${bullet} ${device})
check(examples/scenes FORBID "^(core|host|cpu|gpu|balance|research)/" ${device})
check(examples/cli FORBID "^(core|host|cpu|gpu|balance|research)/" ${device})

set(prefix "")
check(plugin FLAT QUOTED "^$" FORBID ${bullet} ${device} "^Eigen/")  # settings.h: numbers alone
check_layers(plugin "(lazyccd/|settings\\.h$)"
  util:simd
  motion:util
  shapes:util
  exclusion:shapes,util
  scene:exclusion,shapes,motion,util
  contact:scene,motion,util
  touching:scene,shapes,motion,util
  untangling:touching,scene,shapes,motion,util
  links:scene,shapes,util
  bodies:scene,shapes,util
  report:scene,shapes,contact,motion,util
  filter:untangling,contact,scene,motion,util
  obstacles:filter,contact,scene,shapes,motion,util
  detection:obstacles,filter,contact,scene,motion,util
  solver:contact,motion,util
  response:solver,contact,motion,util
  isa:detection,solver,links,contact,motion,util,simd
  step:detection,response,report,filter,untangling,touching,scene,shapes,contact,motion,util
  world:step,bodies,links,report,scene,shapes,contact,motion,util
  text:step)

set(prefix "host/")
check_layers(cuda/host "(core|simd|lazyccd)/"
  threads:
  scene:threads
  kernels:scene
  bvh:kernels,scene,threads)

set(prefix "cpu/")
check_layers(cuda/cpu "(host|core|balance|simd|lazyccd)/"
  strategies:
  verlet:
  narrow:verlet
  isa:narrow)

set(prefix "gpu/")
check_layers(cuda/gpu "(core|cpu|host|balance|lazyccd)/"
  device:
  scene:device
  topology:scene,device
  bvh:scene,device
  narrow:scene,device
  traversal:narrow,bvh,scene,device)

# Only what is for the GPU knows its backend.
set(prefix "research/")
check_layers(cuda/research "(cpu|host|balance|core|lazyccd)/"
  protocols:
  volumes:
  strategies:protocols
  culling:volumes)
check_layers(cuda/research "(gpu|host|balance|core|lazyccd)/"
  gpu_culling:culling,volumes
  gpu_strategies:gpu_culling,protocols)

# cl.exe also looks for an include in the folders of all files above it. So no folder further down has the
# name of one that includes begin with.
file(GLOB_RECURSE folders LIST_DIRECTORIES true ${source_dir}/cuda/*)
foreach(folder IN LISTS folders)
  if(IS_DIRECTORY ${folder} AND folder MATCHES "/cuda/.+/(core|balance|simd|host|cpu|gpu|research)$")
    fail("${folder}: a folder further up has this name")
  endif()
endforeach()

check_size(13 cuda plugin examples tests)

if(failures GREATER 0)
  message(FATAL_ERROR "${failures} failures")
endif()
