# cmake -DSOURCE_DIR=... -DHEADER=... -P Commit.cmake: writes the commit of the sources and the hashes of their folders
# into a header, if they changed.
cmake_minimum_required(VERSION 3.24)
find_package(Git QUIET)
set(commit unknown)
set(trees "")
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} rev-parse --short=12 HEAD
                  OUTPUT_VARIABLE found RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT failed)
    set(commit ${found})
    execute_process(COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} status --porcelain --untracked-files=no -- . :!docs
                    OUTPUT_VARIABLE changes ERROR_QUIET)
    if(changes)
      string(APPEND commit " + changes")
    endif()
    execute_process(COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} ls-tree -r -d HEAD OUTPUT_VARIABLE listed ERROR_QUIET)
    string(REGEX MATCHALL "[0-9a-f]+\t[a-z/]+/(src|include)\n" lines "${listed}")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "([0-9a-f]+)\t(.*)\n" "\\2 \\1\\\\n" line "${line}")
      string(APPEND trees "${line}")
    endforeach()
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT
  "#pragma once\n#define FIELDMARK_COMMIT \"@commit@\"\n#define FIELDMARK_TREES \"@trees@\"\n" @ONLY)
