# cmake -DPROGRAM=test_x -P CheckTestNames.cmake: refuses names that ctest's lists would split or join, for such tests
# are silently not run (an open bracket swallows all that follow).
execute_process(COMMAND ${PROGRAM} --list-test-names-only OUTPUT_VARIABLE names)
if(names MATCHES "\n?([^\n]*[][;\\][^\n]*)\n")
  message(FATAL_ERROR "test name '${CMAKE_MATCH_1}': must be without [ ] ; and backslash, which ctest does not pass on")
endif()
