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
    bslam_use_precompiled(bslam_${name} bslam_precompiled)
    bslam_unite(bslam_${name} 8)
  else()  # headers only
    add_library(bslam_${name} INTERFACE)
    target_link_libraries(bslam_${name} INTERFACE ${ARG_USES} ${ARG_LINKS})
    target_include_directories(bslam_${name} INTERFACE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
  endif()
endfunction()

# bslam_test(NAME [SEPARATE] [USES layer...] [LINKS target...] [SLOW suite...] [THREAD suite...] [DATA suite...]
#            [TOGETHER group=suite+suite...]): one executable of all tests/NAME/*.cc, and one CTest entry for each of its
# suites, so that what the tests of a suite share is made once. Suites of a TOGETHER group are one entry: they share a static
# rendering. SEPARATE: the files use the same names for different things (bslam_unite). Labels: `slow` for SLOW, `thread` for
# THREAD (what ThreadSanitizer looks at), `data` for DATA (reads recordings that may not be there); `fast` for all that are
# neither slow nor data.
function(bslam_test name)
  set(labels SLOW THREAD DATA TOGETHER)
  cmake_parse_arguments(ARG SEPARATE "" "USES;LINKS;${labels}" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cc)
  if(NOT sources)
    return()
  endif()
  list(TRANSFORM ARG_USES PREPEND bslam_)
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE ${ARG_USES} ${ARG_LINKS} GTest::gtest GTest::gtest_main bslam_test_flags)
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  bslam_use_precompiled(test_${name} bslam_tests_precompiled)
  if(NOT ARG_SEPARATE)
    bslam_unite(test_${name} 4)
  endif()
  set(list ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  list(JOIN CMAKE_CROSSCOMPILING_EMULATOR "," emulator)  # lists are handed on with commas
  foreach(label ${labels})
    list(JOIN ARG_${label} "," ${label})
  endforeach()
  add_custom_command(TARGET test_${name} POST_BUILD BYPRODUCTS ${list} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DEXECUTABLE=$<TARGET_FILE:test_${name}> -DEMULATOR=${emulator} -DPREFIX=${name}
            -DOUTPUT=${list} -DSLOW=${SLOW} -DTHREAD=${THREAD} -DDATA=${DATA} -DTOGETHER=${TOGETHER}
            -P ${PROJECT_SOURCE_DIR}/cmake/add_suites.cmake)
  # The executable is linked again where the way its suites are listed has changed.
  set_property(TARGET test_${name} APPEND PROPERTY LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/add_suites.cmake)
  # Executables that are not built have no tests: scripts/test --tsan builds some only.
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake)
  file(WRITE ${include} "include([==[${list}]==] OPTIONAL)\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include})
  if(ARG_THREAD)
    if(NOT TARGET thread_tests)
      add_custom_target(thread_tests)  # all executables with tests of the label thread
    endif()
    add_dependencies(thread_tests test_${name})
  endif()
endfunction()

# Flags of our own code: results do not depend on contraction of multiply and add.
add_library(bslam_flags INTERFACE)
target_compile_options(bslam_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wconversion -Wno-sign-conversion
                                             -ffp-contract=off)
if(BSLAM_WARNINGS_AS_ERRORS)
  target_compile_options(bslam_flags INTERFACE -Werror)
endif()
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Every x86-64 processor since 2009 counts bits in one instruction; without it descriptor distances cost several times
  # as much. Nothing newer is assumed, so that the binary runs anywhere and Eigen's alignment is that of other programs.
  target_compile_options(bslam_flags INTERFACE -msse4.2 -mpopcnt)
endif()
# Tests compile in two thirds of the time if what only they contain is optimised little. Results are the same.
add_library(bslam_test_flags INTERFACE)
target_link_libraries(bslam_test_flags INTERFACE bslam_flags)
target_compile_options(bslam_test_flags INTERFACE $<$<CONFIG:Release>:-O1>)
if(BSLAM_SANITIZE)
  target_compile_options(bslam_flags INTERFACE -fsanitize=${BSLAM_SANITIZE} -fno-omit-frame-pointer)
  # GCC warns of values that the instrumented code seems to use uninitialised.
  target_compile_options(bslam_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_compile_definitions(bslam_flags INTERFACE BSLAM_ONE_VERSION)  # base/vectorised.h
  # Under AddressSanitizer Eigen would choose another allocator than the OpenGV library it shares vectors with.
  target_compile_definitions(bslam_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_link_options(bslam_flags INTERFACE -fsanitize=${BSLAM_SANITIZE})
endif()
