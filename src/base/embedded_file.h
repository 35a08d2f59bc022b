// Embeds a file in the program. The assembler includes it; a compiler would need minutes for an array of millions of
// numbers.
#pragma once

#include <string_view>

// Defines the function `std::string_view NAME()` in the current namespace, which returns the bytes of the file; a zero
// follows them. NAME must be unique in the program; `file` is a string literal.
#define BSLAM_EMBED_FILE(NAME, file)  \
  asm(".pushsection .rodata\n"        \
      ".balign 32\n"                  \
      ".hidden " #NAME                \
      "_begin\n"                      \
      ".hidden " #NAME                \
      "_end\n"                        \
      ".global " #NAME                \
      "_begin\n"                      \
      ".global " #NAME "_end\n" #NAME \
      "_begin:\n"                     \
      ".incbin \"" file "\"\n" #NAME  \
      "_end:\n"                       \
      ".byte 0\n"                     \
      ".popsection\n");               \
  extern "C" {                        \
  extern const char NAME##_begin[];   \
  extern const char NAME##_end[];     \
  }                                   \
  std::string_view NAME() { return {NAME##_begin, NAME##_end}; }
