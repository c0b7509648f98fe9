/* Vectors of floats of the width that the file is compiled for: 4 for what every machine has (SSE2, NEON), 8 for AVX2,
 * 16 for AVX-512. Wider ones than the machine's own would be taken apart by the compiler, badly. Each lane is rounded
 * by itself, so that results are the same bits whatever the width, as long as sums over lanes are not left to it (see
 * sweep_lanes.h), and the compiler fuses no multiplication with an addition (-ffp-contract=off). */
#ifndef SOLVER_LINEAR_LANES_H
#define SOLVER_LINEAR_LANES_H

#include <stdint.h>

/* Rows are padded to whole blocks. */
enum { LANES_BLOCK = 8 };

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__)
#define LANES_NATIVE 16
#elif defined(__AVX2__)
#define LANES_NATIVE 8
#else
#define LANES_NATIVE 4
#endif

/* Floats to be read from any address, and integers of as many lanes: masks are all ones or zeros in each. */
typedef float lanes4 __attribute__((vector_size(16), aligned(4), may_alias));
typedef float lanes8 __attribute__((vector_size(32), aligned(4), may_alias));
typedef float lanes16 __attribute__((vector_size(64), aligned(4), may_alias));
typedef int32_t mask4 __attribute__((vector_size(16)));
typedef int32_t mask8 __attribute__((vector_size(32)));
typedef int32_t mask16 __attribute__((vector_size(64)));

/* The row length that holds `count` numbers. */
static inline uint32_t lanes_padded(uint32_t count)
{
	return (count + LANES_BLOCK - 1) / LANES_BLOCK * LANES_BLOCK;
}

#endif
