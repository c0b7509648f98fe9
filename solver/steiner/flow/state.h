/* What the flow's files share. */
#ifndef SOLVER_STEINER_FLOW_STATE_H
#define SOLVER_STEINER_FLOW_STATE_H

#include "solver/linear/ldl.h"
#include "solver/steiner/flow/flow.h"

/* The price mu+ of the arc ends[0] -> ends[1] and mu- of the arc back, relative to cost times omega. */
struct flow_price {
	float forward, backward;
};

/* Vertices stand at their places in the factor (ldl.rank), parts one after the other; edges in the order of their first
 * end there, so that neighbours in the mesh are neighbours in memory, and an edge belongs to the part of that end. Row
 * length of the matrices: stride, a number for each commodity and padding, whose values stay 0. */
struct flow {
	uint32_t vertex_count, edge_count;
	uint32_t root;            /* index of the root terminal */
	uint32_t ground;          /* its place: all potentials are 0 there */
	uint32_t commodity_count; /* commodity i belongs to terminal i, from the root on to i + 1 */
	uint32_t stride;
	uint32_t *ends; /* [2 * edge_count] places; of an end in the top, the part's copy */
	uint32_t *
		part_edge; /* [ldl.part_count + 2] the edges of each part, those between places of the top at the end */
	/* The instance's edges when the flow was set up, in their order, which deletion keeps: names that last, and
	 * where they stand here. */
	uint32_t *origin; /* [edge_count] */
	uint32_t *slot;   /* [edge_count] */
	float *inverse;   /* [edge_count] 1 / cost; very small costs are raised (state.c) */
	uint32_t *sink;   /* [commodity_count] place of the commodity's terminal */
	struct ldl ldl;
	float omega;
	uint32_t iteration;

	/* u = clamp(z, -mu-, mu+) and w = z - u, the projection of z on K: what ADMM calls the scaled dual and the copy
	 * of the potentials' differences. */
	float *z;                 /* [edge_count * stride] */
	struct flow_price *price; /* [edge_count] */
	float *potential;         /* [ldl.place_count * stride] of the last iteration */
	float *next; /* [ldl.place_count * stride] the right-hand side of the next: A'(w - u), a sum over copies */

	/* Scratch of a split, for the instance as it is then: arc 2e + 1 leads back along edge e. */
	uint32_t *now;  /* [edge_count] where each edge of the instance stands */
	uint32_t *left; /* [2 * edge_count] of each arc's cost, what no commodity before owns */
	uint32_t *side; /* [2 * edge_count] the dual's entry for each arc */
};

static inline uint32_t flow_terminal(const struct flow *flow, uint32_t commodity)
{
	return commodity + (commodity >= flow->root);
}

#endif
