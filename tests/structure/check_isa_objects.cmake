# Code compiled for one instruction set must not reach machines without it: the linker keeps one copy of
# an inline function, whichever object it comes from. So every weak symbol of such an object must carry
# the name of its instruction set.
cmake_minimum_required(VERSION 3.24)

foreach(object IN LISTS objects)
  execute_process(COMMAND ${nm} -C ${object} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" " " symbols "${symbols}")
  string(REPLACE "\n" ";" symbols "${symbols}")
  list(FILTER symbols INCLUDE REGEX " [VWu] ")
  list(FILTER symbols EXCLUDE REGEX "lazyccd::${isa}")
  if(symbols)
    message(FATAL_ERROR "${object}: weak symbols outside lazyccd::${isa}: ${symbols}")
  endif()
endforeach()
