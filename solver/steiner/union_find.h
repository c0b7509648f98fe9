/* Union-find over numbers: parent[x] == x at a representative. Paths are halved on the way (R. E. Tarjan & J. van
 * Leeuwen, Worst-case analysis of set union algorithms, J. ACM 31, 1984). */
#ifndef SOLVER_STEINER_UNION_FIND_H
#define SOLVER_STEINER_UNION_FIND_H

#include <stdint.h>

static inline uint32_t union_find(uint32_t *parent, uint32_t x)
{
	while (parent[x] != x)
		x = parent[x] = parent[parent[x]];
	return x;
}

#endif
