# Toolchain file: cross-builds for 64-bit ARM with Debian's g++-aarch64-linux-gnu and runs tests under qemu-user-static.
# The packages come from the folder that scripts/arm64_sysroot makes; see `scripts/test --arm64`.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(BSLAM_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/arm64_sysroot CACHE PATH "folder of the arm64 packages")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BSLAM_SYSROOT)
get_filename_component(CMAKE_SYSROOT ${BSLAM_SYSROOT} ABSOLUTE)

set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L ${CMAKE_SYSROOT})

set(CMAKE_FIND_ROOT_PATH ${CMAKE_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
