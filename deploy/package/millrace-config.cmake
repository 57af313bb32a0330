# find_package(millrace): the target millrace::sdk, what a service is written with.
include(${CMAKE_CURRENT_LIST_DIR}/millrace-targets.cmake)
# Only services/sdk/command_line.hpp, what it includes, and services/text/fields.hpp need these.
foreach(package IN ITEMS CLI11 spdlog tl-expected)
  find_package(${package} QUIET)
endforeach()
foreach(library IN ITEMS CLI11::CLI11 spdlog::spdlog tl::expected)
  if(TARGET ${library})
    target_link_libraries(millrace::sdk INTERFACE ${library})
  endif()
endforeach()
