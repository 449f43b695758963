/* What every file of the core shares.
 *
 * Rules: no allocation, no global state, no I/O; callers own all buffers and pass their sizes. Results must not depend
 * on the instruction set: the build forbids contraction to fused multiply-add and reordering of floating-point sums.
 */
#ifndef GROUNDSTATION_CORE_H
#define GROUNDSTATION_CORE_H

#include "api.h"

/* Put before loops over integers or independent elements: compiled for AVX2 too and chosen when the library is loaded.
 * Sanitizers cannot run the choosing function that early; clang's clones are no faster and do not give the same bits;
 * GS_NO_CLONES is for the test that both of a library's do. */
#if defined(__x86_64__) && defined(__linux__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(GS_NO_CLONES)
#define GS_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define GS_CLONES
#endif

/* For what a GS_CLONES function calls in its loops: only inside it does it become AVX2 too. */
#if defined(__GNUC__)
#define GS_INLINE static inline __attribute__((always_inline))
#else
#define GS_INLINE static inline
#endif

#endif
