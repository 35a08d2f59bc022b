# bslam_layer(NAME [USES layer...] [LINKS target...]): the static library of src/NAME, made of its .cc files.
# Which layers a layer may use is checked against its includes by scripts/check_layers. The flags of our code stay with the
# layer. Its code can go into the shared library, which exports only what include/bslam marks.
function(bslam_layer name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cc)
  list(TRANSFORM ARG_USES PREPEND bslam_)
  if(sources)
    add_library(bslam_${name} STATIC ${sources})
    target_link_libraries(bslam_${name} PUBLIC ${ARG_USES} ${ARG_LINKS} PRIVATE bslam_flags)
    target_include_directories(bslam_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
    set_target_properties(bslam_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
                                                   VISIBILITY_INLINES_HIDDEN ON)
  else()  # headers only
    add_library(bslam_${name} INTERFACE)
    target_link_libraries(bslam_${name} INTERFACE ${ARG_USES} ${ARG_LINKS})
    target_include_directories(bslam_${name} INTERFACE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
  endif()
endfunction()

# bslam_test(NAME [USES layer...]): one executable of all tests/NAME/*.cc.
function(bslam_test name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cc)
  if(NOT sources)
    return()
  endif()
  list(TRANSFORM ARG_USES PREPEND bslam_)
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE ${ARG_USES} ${ARG_LINKS} GTest::gtest GTest::gtest_main bslam_flags)
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  include(GoogleTest)
  gtest_discover_tests(test_${name} TEST_PREFIX ${name}/ DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()

# Flags of our own code: warnings are errors, results do not depend on contraction of multiply and add.
add_library(bslam_flags INTERFACE)
target_compile_options(bslam_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wconversion -Wno-sign-conversion
                                             -Werror -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Every x86-64 processor since 2009 counts bits in one instruction; without it descriptor distances cost several times
  # as much. Nothing newer is assumed, so that the binary runs anywhere and Eigen's alignment is that of other programs.
  target_compile_options(bslam_flags INTERFACE -msse4.2 -mpopcnt)
endif()
if(BSLAM_SANITIZE)
  target_compile_options(bslam_flags INTERFACE -fsanitize=${BSLAM_SANITIZE} -fno-omit-frame-pointer)
  # Under AddressSanitizer Eigen would choose another allocator than the OpenGV library it shares vectors with.
  target_compile_definitions(bslam_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_link_options(bslam_flags INTERFACE -fsanitize=${BSLAM_SANITIZE})
endif()
