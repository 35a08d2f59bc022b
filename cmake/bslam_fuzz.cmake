# Instrumentation of all code for fuzzing: libFuzzer's where the compiler has it, else gcc's, which reports to
# fuzz/coverage.cc.
include(CheckCXXSourceCompiles)
set(CMAKE_REQUIRED_FLAGS -fsanitize=fuzzer)
check_cxx_source_compiles("#include <cstddef>
  extern \"C\" int LLVMFuzzerTestOneInput(const unsigned char*, std::size_t) { return 0; }" BSLAM_LIBFUZZER)
unset(CMAKE_REQUIRED_FLAGS)

# What a sanitizer finds ends the run.
target_compile_options(bslam_flags INTERFACE -fno-sanitize-recover=all)
if(BSLAM_LIBFUZZER)
  target_compile_options(bslam_flags INTERFACE -fsanitize=fuzzer-no-link)
  target_link_options(bslam_flags INTERFACE -fsanitize=fuzzer-no-link)
else()
  add_library(bslam_coverage STATIC ${PROJECT_SOURCE_DIR}/fuzz/coverage.cc)
  target_include_directories(bslam_coverage PUBLIC ${PROJECT_SOURCE_DIR}/fuzz)
  target_compile_options(bslam_flags INTERFACE -fsanitize-coverage=trace-pc)
  target_link_libraries(bslam_flags INTERFACE bslam_coverage)
endif()
