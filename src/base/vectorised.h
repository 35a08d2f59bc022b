// Functions compiled for several instruction sets, of which the best one that the processor has is called.
#pragma once

// Before the definition of a function whose loops the compiler vectorises. All versions give the same bits: the
// compiler neither reorders sums of floating-point numbers nor contracts products and sums (-ffp-contract=off). A sum
// over many values is therefore written as one partial sum per lane. Functions that it calls must be inlined to be
// compiled with it. Sanitizers start after the choice of a version, so that their builds have only one.
#if defined(__x86_64__) && defined(__ELF__) && defined(__has_attribute) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#if __has_attribute(target_clones)
#define BSLAM_VECTORISED __attribute__((target_clones("avx2", "default")))
#endif
#endif
#ifndef BSLAM_VECTORISED
#define BSLAM_VECTORISED
#endif
