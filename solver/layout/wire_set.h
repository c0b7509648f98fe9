/* The wires of a tree as curves on the pattern, and the rules that they keep. */
#ifndef SOLVER_LAYOUT_WIRE_SET_H
#define SOLVER_LAYOUT_WIRE_SET_H

#include "solver/curve/curve.h"

#include <stdbool.h>
#include <stdint.h>

/* The curve of one branch, from its end[0] to its end[1]. Where it crosses a seam, one span ends at a point of the seam
 * in one piece and the next begins at the same point of the seam in another. */
struct wire {
	struct span *span; /* [span_count] */
	uint32_t span_count;
};

/* Where the wires of a branch end meet on the pattern; a junction lies on the strand that runs through it. */
struct wire_end {
	uint32_t piece;
	struct vec2 at;
	uint64_t key; /* the end in this piece, as network_lay's keys */
	bool on_seam; /* the strand that runs through crosses a seam just here */
};

struct wire_set {
	struct wire *wire;    /* [branch_count] */
	struct wire_end *end; /* [end_count] */
	uint32_t seam_crossings;
};

struct wire_rules {
	double strip_width_mm;
	double minimum_radius_mm;
	double tolerance_mm;          /* how far a curve may stray from the tree's path */
	double clearance_mm;          /* kept from cut lines that are not crossed */
	const uint8_t *face_keep_out; /* [face_count] curves keep off faces with 1; NULL for none */
};

#endif
