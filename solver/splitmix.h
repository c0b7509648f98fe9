/* Pseudo-random numbers that are the same on every machine: SplitMix64 (Steele, Lea & Flood, Fast splittable
 * pseudorandom number generators, OOPSLA 2014). */
#ifndef SOLVER_SPLITMIX_H
#define SOLVER_SPLITMIX_H

#include <stdint.h>

#define SPLITMIX_STEP 0x9e3779b97f4a7c15u

/* The number that follows the state `x`; the next state is x + SPLITMIX_STEP. */
static inline uint64_t splitmix(uint64_t x)
{
	x += SPLITMIX_STEP;
	x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
	x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
	return x ^ (x >> 31);
}

#endif
