# Toolchain of the preset `fuzz`: the Clang that deploy/install-deps --dev installs on this release of Debian. Debian
# 12's own default, Clang 14, lacks standard coroutines.
execute_process(
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/../install-deps --list dev
  OUTPUT_VARIABLE packages COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "clang-([0-9]+)" package "${packages}")
find_program(MILLRACE_CLANG clang-${CMAKE_MATCH_1})
find_program(MILLRACE_CLANGXX clang++-${CMAKE_MATCH_1})
if(NOT MILLRACE_CLANG OR NOT MILLRACE_CLANGXX)
  message(FATAL_ERROR "clang-${CMAKE_MATCH_1} is not installed: run deploy/install-deps --dev")
endif()
set(CMAKE_C_COMPILER ${MILLRACE_CLANG})
set(CMAKE_CXX_COMPILER ${MILLRACE_CLANGXX})
