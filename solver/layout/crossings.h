/* Where a strand crosses a seam: moved along the seam to where the way is straightest, and off the seam's ends. */
#ifndef SOLVER_LAYOUT_CROSSINGS_H
#define SOLVER_LAYOUT_CROSSINGS_H

#include "solver/layout/unfold.h"
#include "solver/pattern/outline.h"

struct crossing_rules {
	double reach_mm;     /* how far along the seam a crossing may move */
	double clearance_mm; /* wished for between a crossing and the end of its seam, where other seams begin */
};

/* Moves every crossing that is not `pinned` [path->count] and lays what comes after it anew. The tree's own crossings
 * are mesh vertices; a moved one lies anywhere in a seam edge, at the same share of it on both sides. */
void crossings_slide(struct unfolded *path, const struct network *network, const struct outline *outline,
		     const bool *pinned, const struct crossing_rules *rules);

#endif
