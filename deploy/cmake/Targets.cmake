# How a millrace target is made: one interface target for common settings, two functions.
include(GNUInstallDirs)

add_library(millrace_options INTERFACE)
target_compile_features(millrace_options INTERFACE cxx_std_20)
# An index out of range, an empty optional: the program stops there in every build, instead of going on with nonsense.
target_compile_definitions(millrace_options INTERFACE _GLIBCXX_ASSERTIONS)
target_compile_options(millrace_options INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wold-style-cast
  -Wnon-virtual-dtor -Woverloaded-virtual -Wnull-dereference -Wimplicit-fallthrough)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 reports these in its own library headers and in coroutine frames at -O2 (PR105562, PR106247).
  # The last one is about the frames of Asio's coroutines, which Asio allocates and frees itself.
  target_compile_options(millrace_options INTERFACE
    -Wno-null-dereference -Wno-maybe-uninitialized -Wno-mismatched-new-delete)
endif()

# A hundred programs are linked, most of them tests: a third of the time of binutils' linker. GCC for another processor
# looks for a mold of that processor's name, which Debian does not have.
find_program(MILLRACE_MOLD mold)
if(MILLRACE_MOLD AND NOT CMAKE_CROSSCOMPILING AND NOT "${CMAKE_EXE_LINKER_FLAGS}" MATCHES "-fuse-ld=")
  add_link_options(-fuse-ld=mold)
endif()

if(MILLRACE_SANITIZE)
  # Whole program, third-party sources of the build included: a sanitizer in some objects only reports nonsense.
  add_compile_options(-fsanitize=${MILLRACE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${MILLRACE_SANITIZE})
  if(MILLRACE_SANITIZE MATCHES "thread" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Asio adds fences, which ThreadSanitizer does not see, to queues behind a mutex, which it does see.
    add_compile_options(-Wno-tsan)
  endif()
endif()
if(MILLRACE_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

if(MILLRACE_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Types of an unnamed namespace in the frames of coroutines: harmless in a source, which GCC takes for a header here.
  target_compile_options(millrace_options INTERFACE -Wno-subobject-linkage)
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC collects garbage from 128 MB on, more than once in most sources: a tenth of their time. It may take 1 GB first.
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=1048576>)
endif()

# What most sources include, parsed once.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled.cpp CONTENT "")
add_library(millrace_precompiled OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
target_link_libraries(millrace_precompiled PRIVATE millrace_options fmt::fmt tl::expected)
set_target_properties(millrace_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)
target_precompile_headers(millrace_precompiled PRIVATE
  <algorithm> <chrono> <functional> <map> <memory> <optional> <sstream> <string> <string_view>
  <unordered_map> <variant> <vector> <fmt/format.h> <tl/expected.hpp>)

# millrace_add_library(NAME SOURCES a.cpp … [PUBLIC lib …] [PRIVATE lib …] [FOLDERS])
# A static library millrace_NAME with the alias millrace::NAME. Its sources are compiled several together
# (MILLRACE_UNITY), since most of what a source costs is the headers it includes; names that collide so are a finding:
# two things of one room should not have one name. FOLDERS puts those of a folder together, for rooms whose folders are
# each a namespace. See docs/dev/hacking.md, "What a build costs". Includes are written from the top of the tree
# ("cnc/ads/frame.hpp"), so the path tells the namespace.
function(millrace_add_library name)
  cmake_parse_arguments(arg "FOLDERS" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(millrace_${name} STATIC ${arg_SOURCES})
  add_library(millrace::${name} ALIAS millrace_${name})
  target_include_directories(millrace_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_compile_features(millrace_${name} PUBLIC cxx_std_20)
  target_link_libraries(millrace_${name} PUBLIC ${arg_PUBLIC} PRIVATE $<BUILD_INTERFACE:millrace_options> ${arg_PRIVATE})
  set_target_properties(millrace_${name} PROPERTIES
    POSITION_INDEPENDENT_CODE ON
    EXPORT_NAME ${name})
  set_target_properties(millrace_${name} PROPERTIES UNITY_BUILD ${MILLRACE_UNITY} UNITY_BUILD_BATCH_SIZE 12)
  # It is valid with the same definitions only.
  target_compile_definitions(millrace_${name} PRIVATE $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)
  if(NOT arg_FOLDERS)
    target_precompile_headers(millrace_${name} REUSE_FROM millrace_precompiled)
  else()
    set_target_properties(millrace_${name} PROPERTIES UNITY_BUILD_MODE GROUP)
    foreach(source IN LISTS arg_SOURCES)
      cmake_path(GET source PARENT_PATH folder)
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
    endforeach()
  endif()
endfunction()

# millrace_add_program(NAME SOURCES … LINK lib … [COMMANDS word …]): an executable in BUILD/bin, installed with the
# package of the room it lives in (Packages.cmake), with its man page and its completion in bash. Each of COMMANDS is the
# first word of a command line of its own, which gets a man page, too.
function(millrace_add_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK;COMMANDS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE millrace_options millrace_commit ${arg_LINK})
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE room)
  string(REGEX REPLACE "/.*" "" room ${room})
  install(TARGETS ${name} COMPONENT ${room})
  # No package is made with a sanitizer.
  if(NOT PROJECT_IS_TOP_LEVEL OR MILLRACE_SANITIZE OR MILLRACE_FUZZ)
    return()
  endif()
  set(folder ${CMAKE_BINARY_DIR}/pages/${name})
  set(pages ${folder}/man1/${name}.1.gz)
  foreach(command IN LISTS arg_COMMANDS)
    list(APPEND pages ${folder}/man1/${name}-${command}.1.gz)
  endforeach()
  add_custom_command(OUTPUT ${pages} ${folder}/completions/${name}
    COMMAND ${PROJECT_SOURCE_DIR}/deploy/package/pages $<TARGET_FILE:${name}> ${folder} ${arg_COMMANDS}
    DEPENDS ${name} ${PROJECT_SOURCE_DIR}/deploy/package/pages
    VERBATIM)
  add_custom_target(${name}-pages ALL DEPENDS ${pages} ${folder}/completions/${name})
  install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${room})
  install(FILES ${folder}/completions/${name} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    COMPONENT ${room})
endfunction()
