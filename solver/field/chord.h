/* Flip chords (method 4): for an edge with two faces, the straight line between the two opposite vertices of the
 * unfolded pair, where it crosses the edge's interior. A wire along it leaves the mesh's edges. */
#ifndef SOLVER_FIELD_CHORD_H
#define SOLVER_FIELD_CHORD_H

#include <stdbool.h>

/* Nearer to an end of the edge, as a share of it, a chord is as good as a way through that vertex. */
#define CHORD_MARGIN 1e-6

/* Where the line from a to b crosses the edge from p to q, as a share from p on; a to the left of it. False where it
 * misses the interior. */
static inline bool chord_crosses(const double p[2], const double q[2], const double a[2], const double b[2],
				 double *share)
{
	double dx = q[0] - p[0], dy = q[1] - p[1];
	double left = dx * (a[1] - p[1]) - dy * (a[0] - p[0]), right = dx * (b[1] - p[1]) - dy * (b[0] - p[0]);
	if (!(left > 0 && right < 0))
		return false;
	double t = left / (left - right), x = a[0] + t * (b[0] - a[0]) - p[0], y = a[1] + t * (b[1] - a[1]) - p[1];
	*share = (x * dx + y * dy) / (dx * dx + dy * dy);
	return *share > CHORD_MARGIN && *share < 1 - CHORD_MARGIN;
}

#endif
