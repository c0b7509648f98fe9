/* A tree cut into branches at its terminals and junctions, and the branches joined into strands that run through
 * junctions (method 6). */
#ifndef SOLVER_LAYOUT_BRANCHES_H
#define SOLVER_LAYOUT_BRANCHES_H

#include "solver/layout/network.h"

#include <stdbool.h>

/* A node at which branches end: first the sites in their order, then the junctions (three or more branches, no
 * terminal) by ascending node. */
struct branch_end {
	uint32_t node;
	uint32_t site; /* GARMENT_NONE at a junction */
	uint32_t degree;
};

/* A path of the tree between two ends, end[0] < end[1]. */
struct branch {
	uint32_t end[2];
	uint32_t edge_count;
	uint32_t *node; /* [edge_count + 1] */
	uint32_t *edge; /* [edge_count] of the network */
};

/* One branch or several, end to end, through junctions at which they are the two straightest. */
struct strand {
	uint32_t first, count; /* of steps */
	uint32_t end[2];       /* a site, or a junction at which another strand runs through */
};

struct strand_step {
	uint32_t branch;
	bool reversed;
};

struct branch_set {
	struct branch_end *end;
	uint32_t end_count;
	struct branch *branch; /* in order of end[0], then of the first edge */
	uint32_t branch_count;
	struct strand *strand; /* ordered so that the strand through a junction stands before those that end there */
	uint32_t strand_count;
	struct strand_step *step;
	uint32_t junction_count;
};

/* `edges`: a tree of the network that spans its terminals. How straight two branches meet is judged on the worn mesh,
 * over the first `reach_mm` of each. TW_ERROR_MEMORY. */
enum tw_status branches_cut(struct branch_set *set, struct arena *arena, const struct network *network,
			    const uint32_t *edges, uint32_t edge_count, double reach_mm,
			    struct tw_error *error) TW_NODISCARD;

#endif
