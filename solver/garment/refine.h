/* Finer meshes of the same garment (method 4). */
#ifndef SOLVER_GARMENT_REFINE_H
#define SOLVER_GARMENT_REFINE_H

#include "solver/garment/garment.h"
#include "solver/garment/options.h"

/* One refinement of `coarse` into `fine`, in `arena`; `fine` shares the piece names with `coarse`.
 *
 * REFINE_MIDPOINT: face f becomes faces 4f to 4f + 3, at its corners 0, 1, 2 and in its middle; the midpoint of edge e
 * is vertex coarse->vertex_count + e. REFINE_CENTROID: face f becomes faces 3f to 3f + 2, on its sides 0, 1, 2; its
 * centroid is vertex coarse->vertex_count + f. The rest keep their numbers. A face's strain is that of its parts, since
 * the new vertices move with the old ones: fine->source_vertex and fine->source_share say how, in terms of the file's
 * vertices; fine->file_face and fine->file_corner say which of the file's faces they are part of. TW_ERROR_LIMIT,
 * TW_ERROR_MEMORY. */
enum tw_status garment_refine(struct garment *fine, struct arena *arena, const struct garment *coarse,
			      const struct topology *topology, enum refinement refinement,
			      struct tw_error *error) TW_NODISCARD;

#endif
