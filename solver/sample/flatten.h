/* Lays a pattern piece flat with little distortion. */
#ifndef SOLVER_SAMPLE_FLATTEN_H
#define SOLVER_SAMPLE_FLATTEN_H

#include "solver/arena.h"
#include "solver/sample/vector.h"

#include <stdbool.h>
#include <stdint.h>

/* A piece on the body: a disc of triangles, counter-clockwise from outside. All borrowed. */
struct flatten_piece {
	uint32_t vertex_count, face_count;
	const struct vec3 *position;
	const uint32_t (*corner)[3];
	struct vec3 upward;   /* unit; lies upright on the sheet */
	double girth, length; /* size of the cloth as a share of the body's, across and along `upward` */
};

/* Writes flat[vertex_count][2] in mm, counter-clockwise, upright, the piece's box starting at (0, 0). Minimises the
 * as-rigid-as-possible energy against the shrunken triangles: L. Liu, L. Zhang, Y. Xu, C. Gotsman, S. Gortler: "A
 * Local/Global Approach to Mesh Parameterization", SGP 2008. False when memory is out. */
bool flatten_piece(double (*flat)[2], struct arena *arena, const struct flatten_piece *piece) TW_NODISCARD;

#endif
