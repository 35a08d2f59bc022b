# Headers of other libraries that most files include, compiled once, so that a build of everything takes less time.
# scripts/test uses them, scripts/test --clang and scripts/build do not, so that a file that lacks an include is found.
set(bslam_precompiled_headers <algorithm> <array> <cmath> <cstdint> <filesystem> <fstream> <functional> <map> <memory> <mutex>
                              <optional> <set> <span> <string> <string_view> <thread> <utility> <vector>
                              <Eigen/Core> <Eigen/Geometry> <Eigen/Cholesky> <Eigen/LU> <fmt/format.h>)

# bslam_precompile(NAME [HEADERS header...] [LINKS target...]): the target NAME, which holds those headers and HEADERS.
function(bslam_precompile name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LINKS" ${ARGN})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cc CONTENT "// Precompiled headers need one source file.\n")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cc)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen fmt::fmt ${ARG_LINKS})
  target_precompile_headers(${name} PRIVATE ${bslam_precompiled_headers} ${ARG_HEADERS})
endfunction()

# bslam_use_precompiled(TARGET NAME): TARGET includes what NAME holds; both must be compiled with the same flags.
function(bslam_use_precompiled target name)
  if(TARGET ${name})
    target_link_libraries(${target} PRIVATE Eigen3::Eigen fmt::fmt)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

# bslam_unite(TARGET FILES): with precompiled headers, FILES sources of the target at a time are compiled as one, since most
# of the time is spent on the headers that they share. Names in anonymous namespaces of these sources must differ.
function(bslam_unite target files)
  if(BSLAM_PRECOMPILED)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${files})
  endif()
endfunction()

# bslam_separate(source...): these sources of the present folder are compiled on their own nevertheless, because they use
# names of others for different things, or because GCC 12 would warn of errors that are none.
function(bslam_separate)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

if(BSLAM_PRECOMPILED)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    add_compile_options(-fpch-preprocess)  # so that ccache sees what a file includes
    add_compile_options(--param=ggc-min-heapsize=500000)  # kB; a tenth of the time was that of the garbage collection
    # GCC 12 warns of errors within std::string that are none if its header is precompiled.
    target_compile_options(bslam_flags INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overread
                                                 -Wno-stringop-overflow)
  endif()
  bslam_precompile(bslam_precompiled LINKS bslam_flags)
  set_target_properties(bslam_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
                                                     VISIBILITY_INLINES_HIDDEN ON)
  if(BSLAM_TESTS)
    find_package(GTest REQUIRED)
    bslam_precompile(bslam_tests_precompiled HEADERS <gtest/gtest.h> LINKS bslam_test_flags GTest::gtest)
  endif()
endif()
