# Fails if `program`, which links LazyCCD::core alone, has a symbol of LazyCCD::research. `library` is
# LazyCCD::research: if it has no such symbol either, the search looks for the wrong name.
#
#   cmake -D nm=nm -D program=... -D library=... -P check_core_alone.cmake
cmake_minimum_required(VERSION 3.24)

function(find_symbols out file)
  execute_process(COMMAND ${nm} -C ${file} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" " " symbols "${symbols}")
  string(REPLACE "\n" ";" symbols "${symbols}")
  list(FILTER symbols INCLUDE REGEX "research")
  set(${out} "${symbols}" PARENT_SCOPE)
endfunction()

find_symbols(symbols ${library})
if(NOT symbols)
  message(FATAL_ERROR "${library} has no symbol of research")
endif()
find_symbols(symbols ${program})
if(symbols)
  message(FATAL_ERROR "${program}: symbols of research: ${symbols}")
endif()
