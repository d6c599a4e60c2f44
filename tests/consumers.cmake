# Tests that build and run the two consumer projects; one of them uses a fresh install of this
# build.
set(consumer_dir ${CMAKE_CURRENT_BINARY_DIR}/consumers)

add_test(NAME "consumer: the package installs"
  COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${consumer_dir}/prefix)
set_tests_properties("consumer: the package installs" PROPERTIES
  FIXTURES_SETUP installed_package LABELS consumer)

function(lazyccd_consumer name folder)
  add_test(NAME "consumer: ${name}"
    COMMAND ${CMAKE_CTEST_COMMAND}
      --build-and-test ${CMAKE_CURRENT_SOURCE_DIR}/${folder} ${consumer_dir}/${folder}
      --build-generator ${CMAKE_GENERATOR}
      --build-options -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} ${ARGN}
      --test-command ${CMAKE_CTEST_COMMAND} --output-on-failure)
  set_tests_properties("consumer: ${name}" PROPERTIES LABELS consumer)
endfunction()

lazyccd_consumer("find_package gives a program that links and runs" consumer_find_package
  -DCMAKE_PREFIX_PATH=${consumer_dir}/prefix)
set_tests_properties("consumer: find_package gives a program that links and runs" PROPERTIES
  FIXTURES_REQUIRED installed_package)
lazyccd_consumer("add_subdirectory gives a program that links and runs" consumer_subdirectory
  -DLAZYCCD_SOURCE_DIR=${PROJECT_SOURCE_DIR} -DLAZYCCD_CUDA=OFF)
