/* The corner of a face that comes first whatever the file says: the lowest on the pattern. Sums over corners and
 * invariants of sides differ in their last bits with the corner that they begin at; beginning here, no figure depends
 * on how a file writes its faces. */
#ifndef SOLVER_GARMENT_FIRST_CORNER_H
#define SOLVER_GARMENT_FIRST_CORNER_H

#include "solver/garment/garment.h"

/* 0, 1 or 2. Two corners of a face never lie on one place of the pattern: it would have no area. */
static inline uint32_t face_first_corner(const struct garment *garment, uint32_t face)
{
	const uint32_t *coord = garment->face_coord + 3 * (size_t)face;
	uint32_t first = 0;
	for (uint32_t k = 1; k < 3; k++) {
		const double *a = garment->pattern + 2 * (size_t)coord[k];
		const double *b = garment->pattern + 2 * (size_t)coord[first];
		if (a[0] < b[0] || (a[0] == b[0] && a[1] < b[1]))
			first = k;
	}
	return first;
}

#endif
