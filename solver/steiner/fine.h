/* Fine weights: the caller's, with a tie-break behind the point.
 *
 * A caller's weight may take 62 bits, and a tree's sum of tie-breaks 32 for the break and 31 for the number of edges:
 * 128 bits hold both, so that no weight is too large for ties to be broken. Sums of a few trees do not overflow. */
#ifndef SOLVER_STEINER_FINE_H
#define SOLVER_STEINER_FINE_H

#include <stdint.h>

/* Aligned like its halves: structures with one fine weight and two numbers take 24 bytes instead of 32, and the hot
 * loops read them from memory more than they add. */
__extension__ typedef unsigned __int128 fine_t __attribute__((aligned(8)));

#define FINE_MAX (~(fine_t)0) /* no weight: "none", "unreached" */

#endif
