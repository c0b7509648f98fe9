/* The wires of a tree as curves on the pattern, and the rules that they keep. */
#ifndef SOLVER_LAYOUT_WIRE_SET_H
#define SOLVER_LAYOUT_WIRE_SET_H

#include "solver/curve/curve.h"

#include <stdbool.h>
#include <stdint.h>

/* Where a curve is farthest from the tree's path, in the plane in which the pieces are laid against each other where
 * the curve crosses their seams. */
struct wire_stray {
	double distance_mm;
	uint32_t piece;
	struct vec2 at; /* on the curve */
};

/* The curve of one branch, from its end[0] to its end[1]. Where it crosses a seam, one span ends at a point of the seam
 * in one piece and the next begins at the same point of the seam in another. */
struct wire {
	struct span *span; /* [span_count] */
	uint32_t span_count;
	struct wire_stray stray;
};

/* Whether a span, not a wire's first, begins where the one before it ends; else the wire crosses a seam between them.
 */
static inline bool wire_goes_on(const struct span *span)
{
	return span[-1].piece == span->piece && vec2_distance(span[-1].to, span->from) < 1e-6;
}

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

struct strip_walker;

struct wire_rules {
	double strip_width_mm;
	double minimum_radius_mm;
	double tolerance_mm;           /* how far a curve may stray from the tree's path */
	double clearance_mm;           /* wished for from cut lines that are not crossed; rules.h says more */
	double spacing_mm;             /* kept between strips that do not meet */
	const uint8_t *face_keep_out;  /* [face_count] strips keep off faces with 1; NULL for none */
	struct strip_walker *keep_out; /* integrates 1 over these faces; NULL for none */
};

#endif
