/* What the flow's files share. */
#ifndef SOLVER_STEINER_FLOW_STATE_H
#define SOLVER_STEINER_FLOW_STATE_H

#include "solver/linear/ldl.h"
#include "solver/steiner/flow/flow.h"

/* The price mu+ of the arc ends[0] -> ends[1] and mu- of the arc back, relative to cost times omega. */
struct flow_price {
	float forward, backward;
};

/* One of the two arcs of an edge, in a split. */
struct flow_side {
	float asked;   /* the share of its cost that all commodities ask for together */
	float scale;   /* what is to be multiplied with their shares */
	uint32_t left; /* of what they ask for, what none before owned */
	uint32_t arc;  /* the dual's entry */
};

struct flow_split_edge {
	uint32_t slot;
	float cost;               /* coarse */
	struct flow_side side[2]; /* ends[0] -> ends[1], and back */
};

/* Commodities that are looked at together: as many floats as a cache line has. */
enum { SPLIT_BLOCK = 16 };

/* What a split is about: the instance's edges as they are then, by slot. */
struct flow_split {
	uint32_t edge_count;
	struct flow_split_edge *edge; /* [edge_count] */
	/* [SPLIT_BLOCK * edge_count] what a block of commodities owns, edge by edge for each: units of cost, positive
	 * of side 0, negative of side 1. */
	int32_t *own;
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
	struct ldl_top top;       /* scratch of a solve */
	float *next; /* [ldl.place_count * stride] the right-hand side of the next: A'(w - u), a sum over copies */

	struct flow_split split; /* scratch of a split, with room for all edges */
};

static inline uint32_t flow_terminal(const struct flow *flow, uint32_t commodity)
{
	return commodity + (commodity >= flow->root);
}

#endif
