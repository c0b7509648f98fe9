/* Curves of the pattern: line segments and circular arcs. */
#ifndef SOLVER_CURVE_CURVE_H
#define SOLVER_CURVE_CURVE_H

#include "solver/curve/vector.h"

#include <stdbool.h>
#include <stdint.h>

/* A line segment (radius 0) or an arc, in the plane of one pattern piece, mm. */
struct span {
	struct vec2 from, to;
	struct vec2 centre; /* of an arc */
	double radius;      /* of an arc; 0 for a line */
	double turn;        /* radians swept by an arc, positive to the left, |turn| < pi; 0 for a line */
	uint32_t piece;
};

struct span span_line(struct vec2 from, struct vec2 to, uint32_t piece);

static inline bool span_is_arc(const struct span *span)
{
	return span->radius > 0;
}

double span_length(const struct span *span);

/* The point and the unit direction at t, 0…1 by length. */
struct vec2 span_point(const struct span *span, double t);
struct vec2 span_direction(const struct span *span, double t);

/* The parameter of the nearest point to p, 0…1. */
double span_nearest(const struct span *span, struct vec2 p);

/* The part from t0 to t1. */
struct span span_part(const struct span *span, double t0, double t1);

/* The same span seen through a rigid motion, and through its inverse. */
struct span span_place(const struct span *span, struct placement placement);
struct span span_unplace(const struct span *span, struct placement placement);

/* The strip of width `width` along the part t0…t1, as a quadrilateral, counter-clockwise: a rectangle on a line, the
 * trapezoid inscribed in the annulus on an arc (method 7). On an arc tighter than half the width it is a triangle whose
 * tip, doubled, is the centre. */
void span_strip(const struct span *span, double t0, double t1, double width, struct vec2 quad[4]);

/* Into how many equal parts an arc is cut so that none turns by more than `step` radians. 1 for a line. */
uint32_t span_cuts(const struct span *span, double step);

#endif
