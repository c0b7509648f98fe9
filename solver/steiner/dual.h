/* Dual bound: a near-optimal solution of the dual of the directed cut relaxation.
 *
 * Direct every tree away from a root terminal. A *cut* is a vertex set without the root that holds a terminal; every
 * tree enters it. A dual gives cuts values y >= 0 such that on no arc the cuts that it enters sum to more than its
 * cost: the sum of y is then a lower bound, and the cost that is left on an arc is its reduced cost. */
#ifndef SOLVER_STEINER_DUAL_H
#define SOLVER_STEINER_DUAL_H

#include "solver/steiner/search.h"

/* Costs of the dual are in *coarse* units of 32 bits: fine weights shifted right, rounded down. All figures here are
 * in coarse units; (x << coarse_shift) is the fine figure, still a lower bound. */
struct dual {
	unsigned coarse_shift;
	uint32_t root;       /* index of the root terminal */
	uint64_t bound;      /* sum of the cuts' values */
	uint32_t *tail;      /* [arc_count] row v of the instance's `first` lists the arcs that enter v: from tail[a] */
	uint32_t *reduced;   /* [arc_count] reduced cost of the arc tail[a] -> v */
	uint32_t *from_root; /* [vertex_count] distance from the root by reduced costs, UINT32_MAX: none */
	uint32_t *to_terminal; /* [vertex_count] distance to the nearest terminal but the root by reduced costs */
	uint32_t *depth; /* [vertex_count * terminal_count] depth[v * terminal_count + t]: sum of the values of t's cuts
			    that hold v */
	uint64_t *value; /* [terminal_count] sum of the values of t's cuts */
};

#endif
