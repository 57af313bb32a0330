# Toolchain of the preset `arm64`: Debian's cross compiler, and libraries of the same Debian for 64-bit Arm (multiarch).
# tests/in_root makes a system that has both and runs the programs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(ENV{PKG_CONFIG_LIBDIR} /usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)
# CPack would take the architecture of the system that packs.
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
