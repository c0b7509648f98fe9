/* Near-equilateral triangles of one size. After M. Botsch, L. Kobbelt: "A Remeshing Approach to Multiresolution
 * Modeling", SGP 2004: split long edges, collapse short ones, flip towards regular vertices, move vertices to the
 * middle of their neighbours along the surface. Seams and borders stay where they are; their vertices move along them
 * only. */
#ifndef SOLVER_SAMPLE_REMESH_H
#define SOLVER_SAMPLE_REMESH_H

#include "solver/sample/body.h"
#include "solver/sample/surface.h"

/* `length`: the edge length to reach, mm. Leaves deleted faces behind (surface_compact). False when memory is out. */
bool remesh_half(struct surface *surface, struct arena *arena, const struct body *body, double length,
		 int rounds) TW_NODISCARD;

#endif
