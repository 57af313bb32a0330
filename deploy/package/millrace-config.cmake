# find_package(millrace): the target millrace::sdk, what a service is written with.
include(CMakeFindDependencyMacro)
find_dependency(tl-expected)
find_dependency(CLI11)
find_dependency(spdlog)
include(${CMAKE_CURRENT_LIST_DIR}/millrace.cmake)
