# Fails if a page links to a file of the project that does not exist, or if the README is too long.
#
#   cmake -D source_dir=. -P tests/structure/check_pages.cmake
cmake_minimum_required(VERSION 3.24)

set(failures 0)
file(GLOB_RECURSE pages ${source_dir}/*.md)
list(FILTER pages EXCLUDE REGEX "/(build|out)[^/]*/")
foreach(page IN LISTS pages)
  file(READ ${page} text)
  string(REPLACE ";" "," text "${text}")
  string(REPLACE "[" "<" text "${text}")  # brackets would group the elements of a list
  string(REPLACE "]" ">" text "${text}")
  string(REGEX MATCHALL ">\\([^) ]+" links "${text}")
  get_filename_component(folder ${page} DIRECTORY)
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^>\\(" "" link "${link}")
    string(REGEX REPLACE "#.*$" "" link "${link}")
    if(link STREQUAL "" OR link MATCHES "^(https?|mailto):" OR EXISTS ${folder}/${link})
      continue()
    endif()
    message("${page}: there is no ${link}")
    math(EXPR failures "${failures} + 1")
  endforeach()
endforeach()

file(STRINGS ${source_dir}/README.md lines ENCODING UTF-8)
list(LENGTH lines count)
if(count GREATER 110)
  message("README.md has ${count} lines; 110 are the most")
  math(EXPR failures "${failures} + 1")
endif()

if(failures GREATER 0)
  message(FATAL_ERROR "${failures} failures")
endif()
