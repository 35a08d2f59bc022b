// Embeds a file in the program. The assembler includes it; a compiler would need minutes for an array of millions of
// numbers.
#pragma once

#include <string_view>

// Defines the function `std::string_view NAME()` in the current namespace, which returns the bytes of the file; a zero
// follows them. NAME must be unique in the program; `file` is a string literal.
// clang-format off
#define BSLAM_EMBED_FILE(NAME, file)                                                                 \
  asm(".pushsection .rodata\n"                                                                       \
      ".balign 32\n"                                                                                 \
      ".hidden bslam_embedded_" #NAME "_begin\n"                                                     \
      ".hidden bslam_embedded_" #NAME "_end\n"                                                       \
      ".global bslam_embedded_" #NAME "_begin\n"                                                     \
      ".global bslam_embedded_" #NAME "_end\n"                                                       \
      "bslam_embedded_" #NAME "_begin:\n"                                                            \
      ".incbin \"" file "\"\n"                                                                       \
      "bslam_embedded_" #NAME "_end:\n"                                                              \
      ".byte 0\n"                                                                                    \
      ".popsection\n");                                                                              \
  extern "C" {                                                                                       \
  extern const char bslam_embedded_##NAME##_begin[];                                                 \
  extern const char bslam_embedded_##NAME##_end[];                                                   \
  }                                                                                                  \
  std::string_view NAME() { return {bslam_embedded_##NAME##_begin, bslam_embedded_##NAME##_end}; }
// clang-format on
