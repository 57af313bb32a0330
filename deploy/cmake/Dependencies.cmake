# Everything millrace is built with. Each is a package of Debian 12 and 13 named in deploy/install-deps.

find_package(Threads REQUIRED)
find_package(Boost 1.81 REQUIRED CONFIG)
find_package(CycloneDDS 0.10 REQUIRED)
find_package(Protobuf REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(tl-expected REQUIRED)
find_package(ZLIB REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4>=1.9)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd>=1.5)
find_package(SQLiteCpp REQUIRED)
find_package(CURL 7.88 REQUIRED)
find_package(OpenSSL 3.0 REQUIRED)
find_package(prometheus-cpp REQUIRED CONFIG)

find_package(PkgConfig REQUIRED)
pkg_check_modules(JEMALLOC REQUIRED IMPORTED_TARGET jemalloc)

# The allocator of programs in which one thread frees what another one has taken, thousands of times a second: what
# Cyclone's receive threads bring. docs/dev/decisions/toolchain.md. Sanitizers have their own.
add_library(millrace_allocator INTERFACE)
add_library(millrace::allocator ALIAS millrace_allocator)
if(NOT MILLRACE_SANITIZE)
  target_link_libraries(millrace_allocator INTERFACE PkgConfig::JEMALLOC)
endif()

# Boost.Asio compiled once instead of in every source that includes it.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/asio/asio.cpp CONTENT "#include <boost/asio/impl/src.hpp>\n")
add_library(millrace_asio STATIC ${CMAKE_BINARY_DIR}/asio/asio.cpp)
add_library(millrace::asio ALIAS millrace_asio)
target_compile_features(millrace_asio PUBLIC cxx_std_20)
target_compile_definitions(millrace_asio PUBLIC BOOST_ASIO_SEPARATE_COMPILATION BOOST_ASIO_NO_DEPRECATED)
target_link_libraries(millrace_asio PUBLIC Boost::headers Threads::Threads)
set_target_properties(millrace_asio PROPERTIES POSITION_INDEPENDENT_CODE ON)

# … and its TLS.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/asio/asio_ssl.cpp CONTENT "#include <boost/asio/ssl/impl/src.hpp>\n")
add_library(millrace_asio_ssl STATIC ${CMAKE_BINARY_DIR}/asio/asio_ssl.cpp)
add_library(millrace::asio_ssl ALIAS millrace_asio_ssl)
target_link_libraries(millrace_asio_ssl PUBLIC millrace_asio OpenSSL::SSL)
set_target_properties(millrace_asio_ssl PROPERTIES POSITION_INDEPENDENT_CODE ON)

# The same for Boost.JSON.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/boost_json/json.cpp CONTENT "#include <boost/json/src.hpp>\n")
add_library(millrace_boost_json STATIC ${CMAKE_BINARY_DIR}/boost_json/json.cpp)
add_library(millrace::boost_json ALIAS millrace_boost_json)
target_compile_features(millrace_boost_json PUBLIC cxx_std_20)
target_link_libraries(millrace_boost_json PUBLIC Boost::headers)
set_target_properties(millrace_boost_json PROPERTIES POSITION_INDEPENDENT_CODE ON)
