#include "base/vectorised.h"

namespace bslam {
namespace {

// The instruction set that the compiler may use in all functions.
constexpr std::string_view kBaseline =
#if defined(__AVX2__)
    "AVX2";
#elif defined(__SSE4_2__)
    "SSE4.2";
#elif defined(__ARM_NEON)
    "NEON";
#else
    "none";
#endif

}  // namespace

std::string_view instruction_set() {
#ifdef BSLAM_SEVERAL_VERSIONS
  if (__builtin_cpu_supports("avx2")) return "AVX2";  // the same test selects the version of BSLAM_VECTORISED functions
#endif
  return kBaseline;
}

}  // namespace bslam
