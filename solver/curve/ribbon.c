#include "solver/curve/ribbon.h"

#include <assert.h>

/* The angle whose chord strays by RIBBON_CHORD_MM from an arc: the sagitta is r (1 - cos(a / 2)), about r a² / 8. */
static double chord_angle(double radius)
{
	double angle = sqrt(8 * RIBBON_CHORD_MM / fmax(radius, RIBBON_CHORD_MM));
	return angle < 0.5 ? angle : 0.5;
}

/* A point beside the curve. On the inner side of an arc that is tighter than the offset, all points are its centre. */
static struct vec2 beside(const struct span *span, double t, double offset)
{
	if (span_is_arc(span) && (span->turn > 0 ? offset : -offset) >= span->radius)
		return span->centre;
	return vec2_along(span_point(span, t), vec2_left(span_direction(span, t)), offset);
}

void ribbon_add_side(struct region_builder *builder, const struct span *span, double offset, bool backwards)
{
	double outer = span->radius + fabs(offset);
	uint32_t cuts = span_is_arc(span) ? span_cuts(span, chord_angle(outer)) : 1;
	for (uint32_t i = 0; i <= cuts; i++)
		region_add_point(builder, beside(span, (double)(backwards ? cuts - i : i) / cuts, offset));
}

/* Beyond the centre of an arc that is tighter than half the width the strip lies on itself: what is there is a sector
 * of its own. */
static void add_sector(struct region_builder *builder, const struct span *span, double beyond)
{
	uint32_t cuts = span_cuts(span, chord_angle(beyond));
	region_begin_loop(builder);
	region_add_point(builder, span->centre);
	for (uint32_t i = 0; i <= cuts; i++) {
		struct vec2 point = span_point(span, (double)(span->turn > 0 ? i : cuts - i) / cuts);
		region_add_point(builder, vec2_along(span->centre, vec2_unit(vec2_sub(span->centre, point)), beyond));
	}
}

void ribbon_add(struct region_builder *builder, const struct span *span, uint32_t span_count, double width)
{
	assert(span_count > 0 && width > 0);
	region_begin_loop(builder);
	for (uint32_t s = 0; s < span_count; s++)
		ribbon_add_side(builder, &span[s], -width / 2, false);
	for (uint32_t s = span_count; s-- > 0;)
		ribbon_add_side(builder, &span[s], width / 2, true);
	for (uint32_t s = 0; s < span_count; s++)
		if (span_is_arc(&span[s]) && width / 2 > span[s].radius)
			add_sector(builder, &span[s], width / 2 - span[s].radius);
}
