/* From a path to a curve. The path is straightened into few legs, priced by the fabric under them; the corners between
 * them are rounded.
 *
 * A curve passes a seam straight: the corner at a crossing is split into two corners, one in each piece, with the
 * crossing between them on a straight leg. So the direction is continuous across the sewn seam, and both pieces meet
 * the seam at the same point. */
#include "solver/layout/draft.h"

#include "solver/curve/corridor.h"
#include "solver/curve/fillet.h"

/* Where a curve breaks a rule, it is drawn again with other corners beside that place, this often at most; for arcs
 * that are too tight, bolder corners are tried first. */
enum { DRAWINGS = 7, BOLDER_DRAWINGS = 2 };
static const double shy = 0.45, bold = 1.6; /* change of a corner's boldness */
static const double split_share = 0.4; /* of the shorter leg: how far the two corners of a split one stand from it */

double draft_stray(const struct draft *draft, uint32_t first, uint32_t end, struct vec2 point)
{
	double nearest = INFINITY;
	for (uint32_t leg = first; leg < end; leg++) {
		const struct vec2 *ends = draft->tree[leg];
		nearest = fmin(nearest,
			       vec2_distance(point, vec2_mix(ends[0], ends[1], vec2_nearest(ends[0], ends[1], point))));
	}
	return nearest;
}

/* How much kept-out fabric the strip of a span covers, mm². */
static double kept_out_area(const struct smoother *smoother, const struct span *span, uint32_t piece)
{
	static const double arc_step = 0.175; /* radians */
	double area = 0;
	uint32_t parts = span_cuts(span, arc_step);
	if (!smoother->rules->keep_out)
		return 0;
	for (uint32_t i = 0; i < parts; i++) {
		struct vec2 quad[4];
		struct place place;
		struct strip strip;
		span_strip(span, (double)i / parts, (i + 1.0) / parts, smoother->rules->strip_width_mm, quad);
		const double corner[8] = {quad[0].x, quad[0].y, quad[1].x, quad[1].y,
					  quad[2].x, quad[2].y, quad[3].x, quad[3].y};
		locator_find(smoother->locator, piece, span_point(span, (i + 0.5) / parts), &place);
		strip_polygon(smoother->rules->keep_out, place.face, corner, 4, &strip);
		area += strip_touches(&strip) ? strip.cost : 0;
	}
	return area;
}

/* The cost of a leg by the fabric under it; INFINITY where it leaves its piece or the tolerance, or where its strip
 * covers what is kept out. */
static double leg_cost(void *context, uint32_t i, uint32_t j)
{
	static const double step_mm = 3;
	const struct draft *draft = context;
	const struct smoother *smoother = draft->smoother;
	uint32_t run = draft->path.leg_run[i];
	struct vec2 a = draft_in_piece(draft, run, draft->path.point[i]),
		    b = draft_in_piece(draft, run, draft->path.point[j]);
	double length = vec2_distance(a, b), sum = 0;
	uint32_t steps = (uint32_t)(length / step_mm) + 2;
	for (uint32_t s = 0; s < steps; s++) {
		struct place place;
		double t = (s + 0.5) / steps;
		locator_find(smoother->locator, draft->path.run[run].piece, vec2_mix(a, b, t), &place);
		struct vec2 point = vec2_mix(draft->path.point[i], draft->path.point[j], t);
		if (place.distance > 0.05 || draft_stray(draft, i, j, point) > draft_held_mm(draft))
			return INFINITY;
		const uint32_t *corner = smoother->network->garment->face_vertex + 3 * (size_t)place.face;
		for (uint32_t k = 0; k < 3; k++)
			sum += place.barycentric[k] * (smoother->vertex_rate ? smoother->vertex_rate[corner[k]] : 1);
	}
	const struct span leg = span_line(a, b, draft->path.run[run].piece);
	return kept_out_area(smoother, &leg, leg.piece) > 0 ? INFINITY : length * sum / steps;
}

/* The polygon of a strand: the kept nodes, split in two (with the node itself between) where the curve must pass. */
struct polygon {
	const uint32_t *kept; /* [kept_count] nodes */
	uint32_t kept_count;
	double *boldness;      /* [kept_count] of the tolerance that a corner may use */
	struct corner *corner; /* [count] tagged with their index */
	uint32_t *run;         /* [count] of the corner's arc, and of the leg behind it */
	uint32_t *origin;      /* [count] index into kept */
	uint32_t count;
};

static void add_corner(struct polygon *polygon, struct vec2 at, uint32_t run, uint32_t origin, double reach)
{
	uint32_t i = polygon->count++;
	polygon->corner[i] = (struct corner){.at = at, .tag = i, .reach = reach};
	polygon->run[i] = run;
	polygon->origin[i] = origin;
}

static void make_corners(const struct draft *draft, struct polygon *polygon)
{
	const struct unfolded *path = &draft->path;
	const uint32_t *kept = polygon->kept;
	polygon->count = 0;
	for (uint32_t k = 0; k < polygon->kept_count; k++) {
		uint32_t node = kept[k];
		struct vec2 at = path->point[node];
		uint32_t in_run = path->leg_run[node ? node - 1 : 0];
		uint32_t out_run = path->leg_run[node + 1 < path->count ? node : node - 1];
		double tolerance = polygon->boldness[k] * draft->tolerance_mm;
		if (k == 0 || k + 1 == polygon->kept_count || !draft->stop[node]) {
			add_corner(polygon, at, out_run, k, tolerance);
			continue;
		}
		struct vec2 in = vec2_sub(at, path->point[kept[k - 1]]);
		struct vec2 out = vec2_sub(path->point[kept[k + 1]], at);
		double shorter = vec2_length(in) < vec2_length(out) ? vec2_length(in) : vec2_length(out);
		struct vec2 through = vec2_unit(vec2_add(vec2_unit(in), vec2_unit(out)));
		/* The new corners stray from the legs by the sine of half the turn. */
		double sine = fabs(vec2_cross(vec2_unit(in), through)), share = split_share * shorter;
		share *= polygon->boldness[k] < 1 ? polygon->boldness[k] : 1;
		double apart = sine > 0 ? tolerance / sine : share;
		apart = apart < share ? apart : share;
		add_corner(polygon, vec2_along(at, through, -apart), in_run, k, tolerance);
		add_corner(polygon, at, out_run, k, 0);
		polygon->corner[polygon->count - 1].fixed = true;
		add_corner(polygon, vec2_along(at, through, apart), out_run, k, tolerance);
	}
}

/* How badly a span breaks the rules, in millimetres: what its radius lacks, how far it is off its piece and beyond the
 * tolerance, and over what length a strip's width of kept-out fabric is covered. */
static double badness(const struct draft *draft, const struct polygon *polygon, const struct span *span,
		      double *radius_lack)
{
	const struct smoother *smoother = draft->smoother;
	const struct wire_rules *rules = smoother->rules;
	uint32_t corner = span->piece, origin = polygon->origin[corner];
	const struct run *run = &draft->path.run[polygon->run[corner]];
	uint32_t first = polygon->kept[origin ? origin - 1 : 0];
	uint32_t end = polygon->kept[origin + 2 < polygon->kept_count ? origin + 2 : polygon->kept_count - 1];
	double lack = span_is_arc(span) ? rules->minimum_radius_mm - span->radius : 0, off = 0, stray = 0;
	uint32_t steps = (uint32_t)(span_length(span) / 2) + 2;
	for (uint32_t i = 1; i < steps; i++) {
		struct place place;
		struct vec2 point = span_point(span, (double)i / steps);
		locator_find(smoother->locator, run->piece, placement_undo(run->placement, point), &place);
		off = fmax(off, place.distance);
		stray = fmax(stray, draft_stray(draft, first, end, point) - draft_held_mm(draft));
	}
	const struct span folded = span_unplace(span, run->placement);
	double covered = kept_out_area(smoother, &folded, run->piece) / rules->strip_width_mm;
	*radius_lack = lack > 1e-6 ? lack : 0;
	return *radius_lack + (off > 0.1 ? off : 0) + (stray > 1e-3 ? stray : 0) + covered;
}

/* A corner that broke rules becomes bolder or shyer; all corners that were made of one node do so once. */
static void change_boldness(struct polygon *polygon, uint32_t corner, uint32_t *changed, double factor)
{
	if (polygon->origin[corner] == *changed)
		return;
	*changed = polygon->origin[corner];
	polygon->boldness[*changed] *= factor;
}

/* How far junctions come to lie from the tree's own beyond the tolerance. The corners that cut them off become shyer.
 */
static double judge_junctions(const struct draft *draft, struct polygon *polygon, const struct span *span,
			      uint32_t count)
{
	double sum = 0;
	uint32_t changed = GARMENT_NONE;
	for (uint32_t node = 1; node + 1 < draft->path.count; node++) {
		double nearest = INFINITY;
		uint32_t corner = 0;
		for (uint32_t s = 0; draft->junction[node] && s < count; s++) {
			struct vec2 junction = draft->tree[node][0];
			double distance =
				vec2_distance(junction, span_point(&span[s], span_nearest(&span[s], junction)));
			if (distance >= nearest)
				continue;
			nearest = distance;
			corner = span[s].piece;
		}
		if (!draft->junction[node] || !(nearest > draft_held_mm(draft)))
			continue;
		sum += nearest - draft_held_mm(draft);
		change_boldness(polygon, corner, &changed, shy);
	}
	return sum;
}

/* The sum over all spans. The corners beside a span that is off its piece become shyer; those of an arc that is too
 * tight become bolder, which sets the two corners of a split one farther apart. */
static double judge(const struct draft *draft, struct polygon *polygon, const struct span *span, uint32_t count,
		    int drawing)
{
	double sum = 0;
	uint32_t changed = GARMENT_NONE;
	for (uint32_t s = 0; s < count; s++) {
		uint32_t corner = span[s].piece;
		double lack, bad = badness(draft, polygon, &span[s], &lack);
		sum += bad;
		if (bad == 0)
			continue;
		uint32_t last = span_is_arc(&span[s]) || corner + 1 == polygon->count ? corner : corner + 1;
		for (uint32_t c = corner; c <= last; c++)
			change_boldness(polygon, c, &changed, bad > lack || drawing >= BOLDER_DRAWINGS ? shy : bold);
	}
	return sum + judge_junctions(draft, polygon, span, count);
}

/* Rounds the polygon, again and again while rules are broken, and keeps the drawing that breaks them least. */
static enum tw_status round_corners(struct draft *draft, struct polygon *polygon, struct tw_error *error)
{
	const struct smoother *smoother = draft->smoother;
	double least = draft->badness = INFINITY;
	for (int drawing = 0; drawing < DRAWINGS && least > 0; drawing++) {
		struct span *span;
		uint32_t count;
		make_corners(draft, polygon);
		enum tw_status status =
			curve_fillet(polygon->corner, polygon->count, smoother->rules->minimum_radius_mm,
				     smoother->arena, &span, &count, error);
		if (status != TW_OK)
			return status;
		double bad = judge(draft, polygon, span, count, drawing);
		for (uint32_t s = 0; s < count; s++)
			span[s].piece = polygon->run[span[s].piece];
		if (bad >= least)
			continue;
		least = bad;
		draft->span = span;
		draft->span_count = count;
		draft->badness = bad;
	}
	return TW_OK;
}

static enum tw_status draw_polygon(struct draft *draft, const uint32_t *kept, uint32_t kept_count,
				   struct tw_error *error)
{
	struct arena *arena = draft->smoother->arena;
	struct polygon polygon = {.kept = kept, .kept_count = kept_count};
	polygon.boldness = ARENA_ARRAY(arena, kept_count, double);
	polygon.corner = ARENA_ARRAY(arena, 3 * (size_t)kept_count, struct corner);
	polygon.run = ARENA_ARRAY(arena, 3 * (size_t)kept_count, uint32_t);
	polygon.origin = ARENA_ARRAY(arena, 3 * (size_t)kept_count, uint32_t);
	if (!polygon.boldness || !polygon.corner || !polygon.run || !polygon.origin)
		return tw_fail_memory(error);
	for (uint32_t k = 0; k < kept_count; k++)
		polygon.boldness[k] = 1;
	return round_corners(draft, &polygon, error);
}

enum tw_status draft_draw(struct draft *draft, struct tw_error *error)
{
	const struct smoother *smoother = draft->smoother;
	uint32_t *kept = ARENA_ARRAY(smoother->arena, draft->path.count, uint32_t), kept_count;
	if (!kept)
		return tw_fail_memory(error);
	struct corridor corridor = {
		.point = draft->path.point,
		.rate = draft->rate,
		.stop = draft->stop,
		.count = draft->path.count,
		.tolerance = draft->tolerance_mm,
		.minimum_radius = smoother->rules->minimum_radius_mm,
		.bend_price = smoother->rules->strip_width_mm,
		.leg_cost = leg_cost,
		.context = draft,
	};
	enum tw_status status = corridor_straighten(&corridor, smoother->arena, kept, &kept_count, error);
	return status != TW_OK ? status : draw_polygon(draft, kept, kept_count, error);
}
