/* An arc that is tangent to both legs of a corner with turn φ touches them at the distance t = r tan(φ/2) from the
 * corner and cuts the corner off by t tan(φ/4). So the choice of radii is the choice of the distances t, of which a leg
 * has room for t at its one end plus t at its other end. */
#include "solver/curve/fillet.h"

#include <assert.h>

/* A turn below this is a straight line: over a metre it is off by 0.1 µm. */
static const double straight = 1e-7;

struct fillet {
	double half_tangent;    /* tan(φ/2) */
	double quarter_tangent; /* tan(φ/4) */
	double reach;           /* t: distance of the touching points from the corner */
	struct vec2 in, out;    /* unit directions of the legs */
};

static void measure(struct fillet *fillet, const struct corner *corner)
{
	fillet->in = vec2_unit(vec2_sub(corner[0].at, corner[-1].at));
	fillet->out = vec2_unit(vec2_sub(corner[1].at, corner[0].at));
	double sine = fabs(vec2_cross(fillet->in, fillet->out)), cosine = vec2_dot(fillet->in, fillet->out);
	/* tan(φ/2) = sin φ / (1 + cos φ); a full turn back has no arc: a very large tangent asks for all there is. */
	fillet->half_tangent = 1 + cosine > 1e-12 ? sine / (1 + cosine) : 1e6;
	double half = fillet->half_tangent;
	fillet->quarter_tangent = half / (1 + sqrt(1 + half * half));
}

/* How much of the leg between corners i and i + 1 each of the two arcs may take at most. */
static void share_leg(struct fillet *fillet, const struct corner *corner, uint32_t i, double minimum_radius,
		      const double *wish, double *grant)
{
	double length = vec2_distance(corner[i].at, corner[i + 1].at);
	double need[2] = {minimum_radius * fillet[i].half_tangent, minimum_radius * fillet[i + 1].half_tangent};
	double sum = need[0] + need[1];
	double rest = length - sum;
	for (int k = 0; k < 2; k++) {
		double part = rest < 0 ? length * (sum > 0 ? need[k] / sum : 0.5) : need[k];
		if (rest > 0) {
			double more[2] = {wish[i] - need[0], wish[i + 1] - need[1]};
			more[0] = more[0] > 0 ? more[0] : 0;
			more[1] = more[1] > 0 ? more[1] : 0;
			double both = more[0] + more[1];
			/* Even shares, but what one does not want the other may have. */
			double even = rest / 2, other = more[1 - k] < even ? rest - more[1 - k] : even;
			part += both <= rest ? more[k] : (more[k] < other ? more[k] : other);
		}
		double *slot = &grant[i + (uint32_t)k];
		*slot = part < *slot ? part : *slot;
	}
}

static void choose_reaches(struct fillet *fillet, const struct corner *corner, uint32_t count, double minimum_radius,
			   double *wish, double *grant)
{
	for (uint32_t i = 0; i < count; i++) {
		bool inner = i > 0 && i + 1 < count;
		fillet[i] = (struct fillet){0};
		if (inner)
			measure(&fillet[i], &corner[i]);
		if (inner && corner[i].fixed)
			fillet[i].half_tangent = fillet[i].quarter_tangent = 0;
		double need = minimum_radius * fillet[i].half_tangent;
		wish[i] = fillet[i].half_tangent < straight ? 0 : corner[i].reach / fillet[i].quarter_tangent;
		wish[i] = wish[i] < need ? need : wish[i];
		grant[i] = wish[i];
	}
	for (uint32_t i = 0; i + 1 < count; i++)
		share_leg(fillet, corner, i, minimum_radius, wish, grant);
	for (uint32_t i = 0; i < count; i++)
		fillet[i].reach = grant[i];
}

static struct span make_arc(const struct fillet *fillet, const struct corner *corner)
{
	double radius = fillet->reach / fillet->half_tangent;
	bool left = vec2_cross(fillet->in, fillet->out) > 0;
	struct span arc = {.radius = radius, .piece = corner->tag};
	arc.from = vec2_along(corner->at, fillet->in, -fillet->reach);
	arc.to = vec2_along(corner->at, fillet->out, fillet->reach);
	arc.centre = vec2_along(arc.from, vec2_left(fillet->in), left ? radius : -radius);
	arc.turn = vec2_angle(fillet->in, fillet->out);
	return arc;
}

enum tw_status curve_fillet(const struct corner *corner, uint32_t count, double minimum_radius, struct arena *arena,
			    struct span **spans, uint32_t *span_count, struct tw_error *error)
{
	assert(count >= 2);
	*spans = ARENA_ARRAY(arena, 2 * (size_t)count, struct span);
	struct arena_mark mark = arena_mark(arena);
	struct fillet *fillet = ARENA_ARRAY(arena, count, struct fillet);
	double *wish = ARENA_ARRAY(arena, count, double), *grant = ARENA_ARRAY(arena, count, double);
	if (!*spans || !fillet || !wish || !grant)
		return tw_fail_memory(error);
	choose_reaches(fillet, corner, count, minimum_radius, wish, grant);
	uint32_t made = 0;
	struct vec2 at = corner[0].at;
	for (uint32_t i = 1; i < count; i++) {
		bool arc = i + 1 < count && fillet[i].half_tangent >= straight && fillet[i].reach > 1e-9;
		struct vec2 to = arc ? vec2_along(corner[i].at, fillet[i].in, -fillet[i].reach) : corner[i].at;
		if (vec2_distance(at, to) > 1e-9)
			(*spans)[made++] = span_line(at, to, corner[i - 1].tag);
		if (arc) {
			(*spans)[made++] = make_arc(&fillet[i], &corner[i]);
			to = (*spans)[made - 1].to;
		}
		at = to;
	}
	assert(made <= 2 * count);
	arena_release(arena, mark);
	*span_count = made;
	return TW_OK;
}
