// Marks the symbols that the shared library exports; all others are hidden.
#pragma once

#if defined(__GNUC__)
#define BSLAM_EXPORT __attribute__((visibility("default")))
#else
#define BSLAM_EXPORT
#endif
