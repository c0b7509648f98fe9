/* A polygon rounded into line segments and circular arcs that join with equal tangents (method 6). */
#ifndef SOLVER_CURVE_FILLET_H
#define SOLVER_CURVE_FILLET_H

#include "solver/arena.h"
#include "solver/curve/curve.h"

/* A corner of the polygon. */
struct corner {
	struct vec2 at;
	uint32_t tag; /* whatever the caller wants to know of the spans: they carry it as their piece */
	double reach; /* mm by which the arc may cut the corner off */
	bool fixed;   /* the curve passes through `at` exactly, straight: its neighbours must be in line with it */
};

/* Rounds the corners 1…count-2. Every arc is as large as its two legs allow (each leg is shared by the arcs at its
 * ends; the smallest radius is granted first, what is left is shared evenly) and its corner's reach. Where even
 * `minimum_radius` has no room, the arc is smaller: the caller sees it in the span's radius. The reach gives way to the
 * smallest radius. A leg has the tag of the corner it starts from, an arc that of its corner. Writes at most 2 * count
 * spans, from the arena; spans of no length are left out. TW_ERROR_MEMORY. */
enum tw_status curve_fillet(const struct corner *corner, uint32_t count, double minimum_radius, struct arena *arena,
			    struct span **spans, uint32_t *span_count, struct tw_error *error) TW_NODISCARD;

#endif
