// Functions compiled for several instruction sets, of which the best one that the processor has is called.
#pragma once

#include <cstddef>  // defines __GLIBC__
#include <string_view>

// Before the definition of a function whose loops the compiler vectorises. All versions give the same bits: the
// compiler neither reorders sums of floating-point numbers nor contracts products and sums (-ffp-contract=off). A sum
// over many values is therefore written as one partial sum per lane. Functions that it calls must be inlined to be
// compiled with it. The loader of glibc chooses the version, before sanitizers start: their builds define
// BSLAM_ONE_VERSION.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__has_attribute) && !defined(BSLAM_ONE_VERSION)
#if __has_attribute(target_clones)
#define BSLAM_VECTORISED __attribute__((target_clones("avx2", "default")))
#define BSLAM_SEVERAL_VERSIONS
#endif
#endif
#ifndef BSLAM_VECTORISED
#define BSLAM_VECTORISED
#endif

namespace bslam {

// The instruction set of the version that is called on this processor: "AVX2", "SSE4.2", "NEON" or "none".
std::string_view instruction_set();

}  // namespace bslam
