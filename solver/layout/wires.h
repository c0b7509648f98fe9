/* The wires: a tree's branches smoothed into line segments and circular arcs on the pattern (method 6). */
#ifndef SOLVER_LAYOUT_WIRES_H
#define SOLVER_LAYOUT_WIRES_H

#include "solver/curve/curve.h"
#include "solver/layout/branches.h"
#include "solver/pattern/outline.h"

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

/* Smooths all branches, strand by strand. `cost_per_mm` [edge_count of the network] is what a millimetre along each
 * edge costs, NULL for the same everywhere. Where a rule cannot be met the curve breaks it as little as there is room
 * for; metrics find that. TW_ERROR_MEMORY. */
enum tw_status wires_smooth(struct wire_set *wires, struct arena *arena, const struct network *network,
			    const struct branch_set *set, const struct outline *outline, const struct locator *locator,
			    const struct wire_rules *rules, const double *cost_per_mm,
			    struct tw_error *error) TW_NODISCARD;

#endif
