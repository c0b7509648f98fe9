/* A garment as strips need it, its faces renumbered so that neighbours lie close together in memory. A file in whatever
 * order its faces come is then weighed nearly as fast as one in a good order: ten times faster than as it is, where it
 * has a million faces. */
#ifndef SOLVER_FIELD_LOCAL_H
#define SOLVER_FIELD_LOCAL_H

#include "solver/garment/garment.h"

/* `garment` and `topology` have the renumbered faces, but the vertices and edges of the original, and each edge its
 * faces in the original's order: the same strips, to the last bit. Of the garment's arrays only the corners'
 * and the positions on the pattern are to be used, of the topology's only those of the edges. */
struct local {
	struct garment garment;
	struct topology topology;
	const uint32_t *face; /* [face_count] the original's face; NULL where nothing was renumbered */
	const uint32_t
		*edge_order; /* [edge_count] edges in an order in which neighbours follow each other; NULL likewise */
};

/* Borrows the original's arrays. Where its order is good already, nothing is copied. TW_ERROR_MEMORY. */
enum tw_status local_build(struct local *local, struct arena *arena, const struct garment *garment,
			   const struct topology *topology, struct tw_error *error) TW_NODISCARD;

/* The values of the original's faces by those of `local`: `value` itself, or a copy. NULL when out of memory. */
const double *local_values(const struct local *local, struct arena *arena, const double *value);

#endif
