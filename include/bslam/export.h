// Marks what the shared library exports; everything else in it is hidden.
#pragma once

#if defined(__GNUC__)
#define BSLAM_EXPORT __attribute__((visibility("default")))
#else
#define BSLAM_EXPORT
#endif
