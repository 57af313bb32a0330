# The commit of the sources, which --version prints. It is a source of its own that is linked with programs, not with
# tests: a new commit compiles this one and links a dozen programs. Run as a script it writes that source, if it changed.
if(CMAKE_SCRIPT_MODE_FILE)
  # A clone, not a folder that lies somewhere in another one.
  if(NOT COMMIT AND EXISTS ${SOURCES}/.git)
    # Without locks, which a commit at the same time would meet.
    execute_process(
      COMMAND ${CMAKE_COMMAND} -E env GIT_OPTIONAL_LOCKS=0
        git -c safe.directory=* -C ${SOURCES} describe --always --dirty=+ --abbrev=12 --exclude=*
      OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
  file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#include "base/program/version.hpp"

const char* millrace::base::program::commit() {
  return "@COMMIT@";
}
]])
  return()
endif()

set(MILLRACE_COMMIT "" CACHE STRING "Commit of these sources; empty: asks git at each build")
set(millrace_commit_source ${CMAKE_BINARY_DIR}/commit/commit.cpp)
add_custom_target(millrace_commit_source
  COMMAND ${CMAKE_COMMAND} "-DCOMMIT=${MILLRACE_COMMIT}" "-DSOURCES=${PROJECT_SOURCE_DIR}" "-DOUTPUT=${millrace_commit_source}"
    -P ${CMAKE_CURRENT_LIST_FILE}
  BYPRODUCTS ${millrace_commit_source}
  VERBATIM)
add_library(millrace_commit OBJECT ${millrace_commit_source})
add_dependencies(millrace_commit millrace_commit_source)
target_compile_features(millrace_commit PRIVATE cxx_std_20)
target_include_directories(millrace_commit PRIVATE ${PROJECT_SOURCE_DIR})
set_target_properties(millrace_commit PROPERTIES POSITION_INDEPENDENT_CODE ON)
