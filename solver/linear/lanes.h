/* Four floats at a time: the vectors that every machine has (SSE2, NEON), so that the compiler need not take wider ones
 * apart. Each lane is rounded by itself, and sums over lanes are added in one fixed tree (lanes_sum): results are the
 * same bits whatever instructions the compiler chooses, as long as it fuses no multiplication with an addition
 * (-ffp-contract=off). */
#ifndef SOLVER_LINEAR_LANES_H
#define SOLVER_LINEAR_LANES_H

#include <stdint.h>

enum { LANES = 4, LANES_BLOCK = 8 }; /* rows are padded to whole blocks, so that loops have two vectors to a turn */

typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef int32_t lanes_mask __attribute__((vector_size(4 * LANES))); /* all ones or zeros in each lane */

static inline lanes lanes_of(float x)
{
	return (lanes){x, x, x, x};
}

/* Where the mask is set, else 0. */
static inline lanes lanes_where(lanes_mask mask, lanes x)
{
	return (lanes)(mask & (lanes_mask)x);
}

static inline lanes lanes_choose(lanes_mask mask, lanes x, lanes y)
{
	return (lanes)((mask & (lanes_mask)x) | (~mask & (lanes_mask)y));
}

static inline lanes lanes_clamp(lanes x, lanes least, lanes most)
{
	x = lanes_choose(x < least, least, x);
	return lanes_choose(x > most, most, x);
}

static inline float lanes_sum(lanes x)
{
	return (x[0] + x[2]) + (x[1] + x[3]);
}

/* The row length that holds `count` numbers. */
static inline uint32_t lanes_padded(uint32_t count)
{
	return (count + LANES_BLOCK - 1) / LANES_BLOCK * LANES_BLOCK;
}

#endif
