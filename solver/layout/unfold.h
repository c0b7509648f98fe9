/* A strand unfolded into one plane: the pattern pieces that it runs through, laid side by side as they are sewn, so
 * that a curve that is smooth in the plane is smooth on the fabric (method 6). */
#ifndef SOLVER_LAYOUT_UNFOLD_H
#define SOLVER_LAYOUT_UNFOLD_H

#include "solver/layout/branches.h"

/* A stretch of the strand in one piece. */
struct run {
	uint32_t piece;
	struct placement placement; /* from the piece's plane to the strand's */
};

struct unfolded {
	uint32_t count;     /* nodes of the strand, >= 2 */
	uint32_t *node;     /* [count] of the network */
	uint32_t *edge;     /* [count - 1] */
	uint32_t *leg_run;  /* [count - 1] run of the leg from node i to node i + 1 */
	uint32_t *leg_face; /* [count - 1] a face that the leg lies in */
	struct vec2 *point; /* [count] in the strand's plane */
	struct vec2
		*leg_from; /* [count - 1] the tree's own path, in the plane of the leg's piece: it stays where it is */
	struct vec2 *leg_to;
	bool *crossing;    /* [count] the strand changes its piece here, at a point of a seam */
	uint64_t *key_in;  /* [count] where leg i - 1 ends, as network_lay's keys; key_out[0] for the first */
	uint64_t *key_out; /* [count] where leg i begins; key_in[count - 1] for the last */
	struct run *run;   /* [run_count] */
	uint32_t run_count;
};

/* An edge on a seam can be laid in either piece: the strand takes the sides that change pieces least often. At a change
 * the next piece is turned by the mean of the two ways to walk around the seam's vertex, which is the straightest way
 * on. The plane is that of the first piece. TW_ERROR_MEMORY. */
enum tw_status strand_unfold(struct unfolded *unfolded, struct arena *arena, const struct network *network,
			     const struct branch_set *set, const struct strand *strand,
			     struct tw_error *error) TW_NODISCARD;

/* Where a strand ends at a seam, on another strand that runs through in a piece beyond it. */
struct beyond {
	uint32_t piece;
	uint64_t key;   /* of the strand's end in that piece */
	struct vec2 at; /* the point in that piece to go on to */
};

/* Lets the strand go on across the seam at its first (which = 0) or last node: one node and one run more. */
void strand_extend(struct unfolded *unfolded, const struct network *network, uint32_t which,
		   const struct beyond *beyond);

#endif
