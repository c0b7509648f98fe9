/* The first, rough mesh of half the body, already cut open and cut into pieces. */
#ifndef SOLVER_SAMPLE_EXTRACT_H
#define SOLVER_SAMPLE_EXTRACT_H

#include "solver/sample/body.h"
#include "solver/sample/surface.h"

/* Pieces of one half: part * 2 + (1 for the back). */
enum { HALF_PIECES = 6 };

static inline enum body_part piece_part(uint8_t piece)
{
	return (enum body_part)(piece / 2);
}

/* Room for `vertex_capacity` vertices and twice as many faces; the rough mesh itself needs about 20,000. Seams and
 * openings are edge paths of the mesh; triangles are of any shape. False when memory or room is out. */
bool extract_half(struct surface *surface, struct arena *arena, const struct body *body,
		  uint32_t vertex_capacity) TW_NODISCARD;

#endif
