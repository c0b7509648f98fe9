/* One half of the suit: a good mesh of the asked size on the size-L body, cut into six pieces, each with its flat
 * pattern. The other half is the mirror image. */
#ifndef SOLVER_SAMPLE_HALF_H
#define SOLVER_SAMPLE_HALF_H

#include "solver/sample/body.h"
#include "solver/sample/extract.h"
#include "solver/sample/surface.h"

struct half {
	struct surface surface; /* faces ordered by piece */
	uint32_t coord_count;
	double (*flat)[2];    /* [coord_count] mm; each piece's box starts at (0, 0) */
	uint32_t (*coord)[3]; /* [face] pattern position of each corner */
};

/* Meshes the half so that the whole suit has about `vertices` vertices after `levels` midpoint subdivisions; no pattern
 * yet. False when memory is out. */
bool half_mesh(struct half *half, struct arena *arena, const struct body *body, uint32_t vertices,
	       int levels) TW_NODISCARD;

/* Makes the pattern for a wearer whose body is the size-L body scaled by `scale` along x, y and z. */
bool half_flatten(struct half *half, struct arena *arena, const struct body *body, struct vec3 scale) TW_NODISCARD;

/* Divides every face into four at its edges' midpoints, moved to the skin; the pattern follows. The new half is
 * separate. */
bool half_refine(struct half *fine, struct arena *arena, const struct body *body,
		 const struct half *coarse) TW_NODISCARD;

/* Vertices of the whole suit. */
uint32_t half_whole_count(const struct half *half);

#endif
