#include "solver/curve/curve.h"

struct span span_line(struct vec2 from, struct vec2 to, uint32_t piece)
{
	return (struct span){.from = from, .to = to, .piece = piece};
}

double span_length(const struct span *span)
{
	return span_is_arc(span) ? span->radius * fabs(span->turn) : vec2_distance(span->from, span->to);
}

struct vec2 span_point(const struct span *span, double t)
{
	if (t <= 0)
		return span->from;
	if (t >= 1)
		return span->to;
	if (!span_is_arc(span))
		return vec2_mix(span->from, span->to, t);
	struct vec2 spoke = vec2_sub(span->from, span->centre);
	return vec2_add(span->centre, vec2_rotate(spoke, vec2_of_angle(t * span->turn)));
}

struct vec2 span_direction(const struct span *span, double t)
{
	if (!span_is_arc(span))
		return vec2_unit(vec2_sub(span->to, span->from));
	struct vec2 spoke = vec2_unit(vec2_sub(span_point(span, t), span->centre));
	return span->turn > 0 ? vec2_left(spoke) : vec2_scale(vec2_left(spoke), -1);
}

double span_nearest(const struct span *span, struct vec2 p)
{
	if (!span_is_arc(span))
		return vec2_nearest(span->from, span->to, p);
	struct vec2 spoke = vec2_sub(p, span->centre);
	if (vec2_length(spoke) == 0)
		return 0;
	/* Measured from the arc's middle, an angle within half the turn hits the arc; others are nearest to an end. */
	struct vec2 middle = vec2_sub(span_point(span, 0.5), span->centre);
	double t = 0.5 + vec2_angle(middle, spoke) / span->turn;
	return t < 0 ? 0 : t > 1 ? 1 : t;
}

struct span span_part(const struct span *span, double t0, double t1)
{
	struct span part = *span;
	part.from = span_point(span, t0);
	part.to = span_point(span, t1);
	part.turn = span->turn * (t1 - t0);
	return part;
}

struct span span_place(const struct span *span, struct placement placement)
{
	struct span placed = *span;
	placed.from = placement_apply(placement, span->from);
	placed.to = placement_apply(placement, span->to);
	placed.centre = placement_apply(placement, span->centre);
	return placed;
}

struct span span_unplace(const struct span *span, struct placement placement)
{
	struct span placed = *span;
	placed.from = placement_undo(placement, span->from);
	placed.to = placement_undo(placement, span->to);
	placed.centre = placement_undo(placement, span->centre);
	return placed;
}

/* The two corners of the strip at a point of the curve: to the right and to the left of its direction. */
static void strip_ends(const struct span *span, double t, double half, struct vec2 *right, struct vec2 *left)
{
	struct vec2 point = span_point(span, t), side = vec2_left(span_direction(span, t));
	*right = vec2_along(point, side, -half);
	*left = vec2_along(point, side, half);
	if (!span_is_arc(span) || half <= span->radius)
		return;
	*(span->turn > 0 ? left : right) = span->centre;
}

void span_strip(const struct span *span, double t0, double t1, double width, struct vec2 quad[4])
{
	strip_ends(span, t0, width / 2, &quad[0], &quad[3]);
	strip_ends(span, t1, width / 2, &quad[1], &quad[2]);
}

uint32_t span_cuts(const struct span *span, double step)
{
	double cuts = ceil(fabs(span->turn) / step);
	return cuts < 1 ? 1 : (uint32_t)cuts;
}
