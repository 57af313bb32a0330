# The service library as a package of its own: one shared library, its headers, a CMake and a pkg-config file.
#
#   for part in sdk sdk-dev; do cmake --install build --component $part --prefix /usr/local; done
#
# Shared, so that a service outside this tree needs neither Cyclone's nor Boost's headers, and one in C links as C.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package ${CMAKE_CURRENT_LIST_DIR}/../package)
set(sdk_includes ${CMAKE_INSTALL_INCLUDEDIR}/millrace)
set(sdk_config ${CMAKE_INSTALL_LIBDIR}/cmake/millrace)

# All of what services see, as objects; of what is below, only what is used.
add_library(millrace_sdk_shared SHARED
  $<TARGET_OBJECTS:millrace_sdk> $<TARGET_OBJECTS:millrace_fabric_values> $<TARGET_OBJECTS:millrace_messages>
  $<TARGET_OBJECTS:millrace_program> $<TARGET_OBJECTS:millrace_commit>
  $<TARGET_OBJECTS:millrace_service_text>)
set_target_properties(millrace_sdk_shared PROPERTIES LINKER_LANGUAGE CXX)
target_link_libraries(millrace_sdk_shared PRIVATE millrace_sdk)
target_link_options(millrace_sdk_shared PRIVATE LINKER:--version-script=${package}/sdk.symbols)
set_property(TARGET millrace_sdk_shared APPEND PROPERTY LINK_DEPENDS ${package}/sdk.symbols)
target_compile_features(millrace_sdk_shared INTERFACE cxx_std_20)
target_include_directories(millrace_sdk_shared INTERFACE $<INSTALL_INTERFACE:${sdk_includes}>)
set_target_properties(millrace_sdk_shared PROPERTIES
  EXPORT_NAME sdk
  OUTPUT_NAME millrace-sdk
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib
  VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

install(TARGETS millrace_sdk_shared EXPORT millrace LIBRARY COMPONENT sdk NAMELINK_COMPONENT sdk-dev)
# It includes every file that is named as itself and a configuration, so its name is not millrace.cmake.
install(EXPORT millrace FILE millrace-targets.cmake NAMESPACE millrace:: DESTINATION ${sdk_config} COMPONENT sdk-dev)

# The headers that a service includes, and those that they include.
set(headers
  fabric/profile/command_line.hpp fabric/profile/profile.hpp fabric/fields.hpp fabric/messages.hpp fabric/alarm.hpp fabric/dds/participant.hpp
  base/messages/message.hpp base/program/command_line.hpp base/program/log.hpp
  services/sdk/call.hpp services/sdk/command_line.hpp services/sdk/main.hpp services/sdk/shared_participant.hpp
  services/sdk/alarms.hpp services/sdk/asio.hpp services/sdk/response.hpp services/sdk/service.hpp services/sdk/typed.hpp
  services/sdk/testing/fake_call.hpp services/sdk/testing/loopback.hpp services/text/answer.hpp services/text/fields.hpp)
foreach(header IN LISTS headers)
  cmake_path(GET header PARENT_PATH folder)
  install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION ${sdk_includes}/${folder} COMPONENT sdk-dev)
endforeach()
# On top, because sources written for the vendor's SDK name no folder.
install(FILES ${PROJECT_SOURCE_DIR}/services/sdk/isg_service.h DESTINATION ${sdk_includes} COMPONENT sdk-dev)

write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/millrace-config-version.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMajorVersion)
# From the folder of the .pc file back to the prefix, which is only known when it is installed.
cmake_path(RELATIVE_PATH CMAKE_SOURCE_DIR BASE_DIRECTORY ${CMAKE_SOURCE_DIR}/${CMAKE_INSTALL_LIBDIR}/pkgconfig
  OUTPUT_VARIABLE millrace_up_from_pc)
configure_file(${package}/millrace-sdk.pc.in ${CMAKE_CURRENT_BINARY_DIR}/millrace-sdk.pc @ONLY)
install(FILES ${package}/millrace-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/millrace-config-version.cmake
  DESTINATION ${sdk_config} COMPONENT sdk-dev)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/millrace-sdk.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT sdk-dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/services/template ${PROJECT_SOURCE_DIR}/deploy/examples/isg
  DESTINATION ${CMAKE_INSTALL_DATADIR}/millrace COMPONENT sdk-dev)
