/* A strand is unfolded into one plane, kept clear of the cut lines, straightened into few legs, its corners rounded,
 * and folded back onto its pieces; then it is cut into its branches at the junctions. A strand that ends at a junction
 * ends on the curve of the strand that runs through, which is why strands are taken in that order.
 *
 * A curve passes a seam straight: the corner at a crossing is split into two corners, one in each piece, with the
 * crossing between them on a straight leg. So the direction is continuous across the sewn seam, and both pieces meet
 * the seam at the same point. */
#include "solver/layout/wires.h"

#include "solver/curve/corridor.h"
#include "solver/curve/fillet.h"
#include "solver/layout/crossings.h"
#include "solver/layout/unfold.h"

#include <string.h>

/* Curves are drawn boldly first. Where one breaks a rule, the corners beside that place are drawn shyer, this many
 * times: cut by less, and split by less where the curve must pass through. */
enum { DRAWINGS = 7, BOLDER_DRAWINGS = 2 };
static const double split_share = 0.4; /* of the shorter leg: how far the two corners of a split one stand from it */

struct smoother {
	struct wire_set *wires;
	struct arena *arena;
	const struct network *network;
	const struct branch_set *set;
	const struct outline *outline;
	const struct locator *locator;
	const struct wire_rules *rules;
	const double *cost_per_mm;
	const double *vertex_rate; /* [vertex_count] mean cost_per_mm of the edges at a vertex; NULL without costs */
	bool *end_known;           /* [end_count] */
};

/* One strand at work. */
struct draft {
	struct smoother *smoother;
	const struct strand *strand;
	struct unfolded path;
	bool extended_first; /* a node was put before the strand's own first */
	bool *stop;          /* [path.count] */
	double *rate;        /* [path.count] */
	struct span *span;   /* in the strand's plane; a span's piece is its run */
	uint32_t span_count;
};

static struct vec2 in_piece(const struct draft *draft, uint32_t run, struct vec2 point)
{
	return placement_undo(draft->path.run[run].placement, point);
}

/* A strand that ends at a junction ends on the curve of the strand that runs through. Where that one runs in another
 * piece, this one crosses the seam at the junction's vertex and meets it there. */
static void attach_end(struct draft *draft, uint32_t which)
{
	const struct smoother *smoother = draft->smoother;
	uint32_t end = draft->strand->end[which];
	struct unfolded *path = &draft->path;
	uint32_t node = which ? path->count - 1 : 0;
	const struct wire_end *place = &smoother->wires->end[end];
	if (smoother->set->end[end].site != GARMENT_NONE || place->on_seam)
		return;
	if ((which ? path->key_in[node] : path->key_out[node]) != place->key) {
		struct beyond beyond = {place->piece, place->key, place->at};
		strand_extend(path, smoother->network, which, &beyond);
		draft->extended_first |= which == 0;
		return;
	}
	const struct run *run = &path->run[path->leg_run[which ? node - 1 : 0]];
	path->point[node] = placement_apply(run->placement, place->at);
}

/* The curve must pass through its ends and its crossings. */
static void find_stops(struct draft *draft)
{
	for (uint32_t i = 0; i < draft->path.count; i++)
		draft->stop[i] = draft->path.crossing[i] || i == 0 || i + 1 == draft->path.count;
}

/* Crossings at junctions stay where they are, because other strands meet there. */
static enum tw_status slide_crossings(struct draft *draft, struct tw_error *error)
{
	const struct smoother *smoother = draft->smoother;
	bool *pinned = ARENA_ZEROED(smoother->arena, draft->path.count, bool);
	if (!pinned)
		return tw_fail_memory(error);
	uint32_t node = draft->extended_first;
	for (uint32_t i = 0; i + 1 < draft->strand->count; i++) {
		node += smoother->set->branch[smoother->set->step[draft->strand->first + i].branch].edge_count;
		pinned[node] = true;
	}
	const struct crossing_rules rules = {.reach_mm = 2 * smoother->rules->tolerance_mm,
					     .clearance_mm = smoother->rules->clearance_mm};
	crossings_slide(&draft->path, smoother->network, smoother->outline, pinned, &rules);
	return TW_OK;
}

static void find_rates(struct draft *draft)
{
	const double *cost = draft->smoother->cost_per_mm;
	const struct unfolded *path = &draft->path;
	for (uint32_t i = 0; i < path->count; i++) {
		double before = cost && i > 0 ? cost[path->edge[i - 1]] : 1;
		double behind = cost && i + 1 < path->count ? cost[path->edge[i]] : 1;
		if (i == 0)
			before = behind;
		if (i + 1 == path->count)
			behind = before;
		draft->rate[i] = (before + behind) / 2;
	}
}

/* Length of the path from each node to the nearest stop. */
static void find_leeway(const struct draft *draft, double *leeway)
{
	const struct unfolded *path = &draft->path;
	double run = 0;
	for (uint32_t i = 0; i < path->count; i++) {
		run = i ? run + vec2_distance(path->point[i - 1], path->point[i]) : 0;
		run = draft->stop[i] ? 0 : run;
		leeway[i] = run;
	}
	run = 0;
	for (uint32_t i = path->count; i-- > 0;) {
		run += i + 1 < path->count ? vec2_distance(path->point[i], path->point[i + 1]) : 0;
		run = draft->stop[i] ? 0 : run;
		leeway[i] = run < leeway[i] ? run : leeway[i];
	}
}

/* Moves a point of a piece inwards until it keeps `clearance` from the cut line. In a narrow place it goes as far as it
 * gets. */
static struct vec2 move_inwards(const struct draft *draft, uint32_t piece, struct vec2 point, double clearance)
{
	const struct smoother *smoother = draft->smoother;
	const struct garment *garment = smoother->network->garment;
	struct vec2 best = point;
	double depth = 0;
	for (int round = 0; round < 4; round++) {
		uint32_t segment = GARMENT_NONE;
		double distance = outline_distance(smoother->outline, garment, piece, point, &segment);
		if (segment == GARMENT_NONE)
			break;
		struct place place;
		locator_find(smoother->locator, piece, point, &place);
		distance = place.distance > 1e-6 ? -distance : distance;
		if (round == 0 || distance > depth) {
			depth = distance;
			best = point;
		}
		if (distance >= clearance - 1e-6)
			break;
		struct vec2 from, to;
		outline_ends(smoother->outline, garment, segment, &from, &to);
		struct vec2 foot = vec2_mix(from, to, vec2_nearest(from, to, point));
		struct vec2 inward = vec2_left(vec2_unit(vec2_sub(to, from)));
		if (distance > 1e-3)
			inward = vec2_unit(vec2_sub(point, foot));
		point = vec2_along(foot, inward, clearance);
	}
	return best;
}

static void keep_clear(struct draft *draft, double *leeway)
{
	struct unfolded *path = &draft->path;
	find_leeway(draft, leeway);
	for (uint32_t i = 0; i < path->count; i++) {
		uint32_t run = path->leg_run[i + 1 < path->count ? i : i - 1];
		/* Towards a crossing, and towards a terminal at the cut line, the wire comes closer step by step. */
		double clearance = 0.8 * leeway[i];
		if (clearance > draft->smoother->rules->clearance_mm)
			clearance = draft->smoother->rules->clearance_mm;
		struct vec2 point = in_piece(draft, run, path->point[i]);
		struct vec2 moved = move_inwards(draft, path->run[run].piece, point, clearance);
		if (!draft->stop[i])
			path->point[i] = placement_apply(path->run[run].placement, moved);
	}
}

/* The cost of a leg by the fabric under it; INFINITY where it leaves its piece or enters a keep-out. */
static double leg_cost(void *context, uint32_t i, uint32_t j)
{
	static const double step_mm = 4;
	const struct draft *draft = context;
	const struct smoother *smoother = draft->smoother;
	const uint8_t *keep_out = smoother->rules->face_keep_out;
	uint32_t run = draft->path.leg_run[i];
	struct vec2 a = in_piece(draft, run, draft->path.point[i]), b = in_piece(draft, run, draft->path.point[j]);
	double length = vec2_distance(a, b), sum = 0;
	uint32_t steps = (uint32_t)(length / step_mm) + 2;
	for (uint32_t s = 0; s < steps; s++) {
		struct place place;
		locator_find(smoother->locator, draft->path.run[run].piece, vec2_mix(a, b, (s + 0.5) / steps), &place);
		if (place.distance > 0.05 || (keep_out && keep_out[place.face]))
			return INFINITY;
		const uint32_t *corner = smoother->network->garment->face_vertex + 3 * (size_t)place.face;
		for (uint32_t k = 0; k < 3; k++)
			sum += place.barycentric[k] * (smoother->vertex_rate ? smoother->vertex_rate[corner[k]] : 1);
	}
	return length * sum / steps;
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
		double tolerance = polygon->boldness[k] * draft->smoother->rules->tolerance_mm;
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

/* How badly a span breaks the rules, in millimetres: what its radius lacks, and how far it is off its piece. */
static double badness(const struct draft *draft, const struct span *span, uint32_t run_index, double *radius_lack)
{
	const struct smoother *smoother = draft->smoother;
	const uint8_t *keep_out = smoother->rules->face_keep_out;
	const struct run *run = &draft->path.run[run_index];
	double lack = span_is_arc(span) ? smoother->rules->minimum_radius_mm - span->radius : 0, off = 0;
	uint32_t steps = (uint32_t)(span_length(span) / 3) + 2;
	for (uint32_t i = 1; i < steps; i++) {
		struct place place;
		struct vec2 point = placement_undo(run->placement, span_point(span, (double)i / steps));
		locator_find(smoother->locator, run->piece, point, &place);
		double here = place.distance + (keep_out && keep_out[place.face] ? 1 : 0);
		off = here > off ? here : off;
	}
	*radius_lack = lack > 1e-6 ? lack : 0;
	return *radius_lack + (off > 0.1 ? off : 0);
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
		double lack, bad = badness(draft, &span[s], polygon->run[corner], &lack);
		sum += bad;
		if (bad == 0)
			continue;
		uint32_t last = span_is_arc(&span[s]) || corner + 1 == polygon->count ? corner : corner + 1;
		for (uint32_t c = corner; c <= last; c++) {
			if (polygon->origin[c] == changed)
				continue;
			changed = polygon->origin[c];
			polygon->boldness[changed] *= bad > lack || drawing >= BOLDER_DRAWINGS ? 0.45 : 1.6;
		}
	}
	return sum;
}

/* Rounds the polygon, again and again while rules are broken, and keeps the drawing that breaks them least. */
static enum tw_status round_corners(struct draft *draft, struct polygon *polygon, struct tw_error *error)
{
	const struct smoother *smoother = draft->smoother;
	double least = INFINITY;
	for (int drawing = 0; drawing < DRAWINGS && least > 0; drawing++) {
		struct span *span;
		uint32_t count;
		make_corners(draft, polygon);
		enum tw_status status =
			curve_fillet(polygon->corner, polygon->count, smoother->rules->minimum_radius_mm,
				     smoother->arena, &span, &count, error);
		if (status)
			return status;
		double bad = judge(draft, polygon, span, count, drawing);
		for (uint32_t s = 0; s < count; s++)
			span[s].piece = polygon->run[span[s].piece];
		if (bad >= least)
			continue;
		least = bad;
		draft->span = span;
		draft->span_count = count;
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

static enum tw_status draw(struct draft *draft, struct tw_error *error)
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
		.tolerance = smoother->rules->tolerance_mm,
		.minimum_radius = smoother->rules->minimum_radius_mm,
		.bend_price = smoother->rules->strip_width_mm,
		.leg_cost = leg_cost,
		.context = draft,
	};
	enum tw_status status = corridor_straighten(&corridor, smoother->arena, kept, &kept_count, error);
	return status ? status : draw_polygon(draft, kept, kept_count, error);
}

/* The place on the strand's curve that is nearest to a point, at or behind (*span, *t). */
static void nearest_on_curve(const struct draft *draft, struct vec2 point, uint32_t *span, double *t)
{
	double best = INFINITY;
	uint32_t first = *span;
	double from = *t;
	for (uint32_t s = first; s < draft->span_count; s++) {
		double at = span_nearest(&draft->span[s], point);
		if (s == first && at < from)
			at = from;
		double distance = vec2_distance(point, span_point(&draft->span[s], at));
		if (distance < best - 1e-9) {
			best = distance;
			*span = s;
			*t = at;
		}
	}
}

/* A span of the strand's plane in the plane of its piece. */
static struct span fold(const struct draft *draft, const struct span *span)
{
	const struct run *run = &draft->path.run[span->piece];
	struct span folded = span_unplace(span, run->placement);
	folded.piece = run->piece;
	return folded;
}

static struct span reverse(const struct span *span)
{
	struct span back = *span;
	back.from = span->to;
	back.to = span->from;
	back.turn = -span->turn;
	return back;
}

struct cut {
	uint32_t span;
	double t;
};

/* The part of the curve between two cuts becomes the wire of a branch. */
static enum tw_status take_wire(struct draft *draft, const struct strand_step *step, struct cut from, struct cut to,
				struct tw_error *error)
{
	struct wire *wire = &draft->smoother->wires->wire[step->branch];
	wire->span = ARENA_ARRAY(draft->smoother->arena, to.span - from.span + 1, struct span);
	if (!wire->span)
		return tw_fail_memory(error);
	for (uint32_t s = from.span; s <= to.span && s < draft->span_count; s++) {
		double t0 = s == from.span ? from.t : 0, t1 = s == to.span ? to.t : 1;
		if (t1 - t0 < 1e-12 || (t1 - t0) * span_length(&draft->span[s]) < 1e-9)
			continue;
		struct span part = span_part(&draft->span[s], t0, t1);
		wire->span[wire->span_count++] = fold(draft, &part);
	}
	if (!step->reversed)
		return TW_OK;
	for (uint32_t i = 0, j = wire->span_count; i < j--; i++) {
		struct span first = reverse(&wire->span[i]), last = reverse(&wire->span[j]);
		wire->span[i] = last;
		wire->span[j] = first;
	}
	return TW_OK;
}

/* `node`: of the path, at or near which the end lies. */
static void know_end(struct draft *draft, uint32_t end, uint32_t node, uint32_t run, struct vec2 at)
{
	struct smoother *smoother = draft->smoother;
	if (smoother->end_known[end])
		return;
	smoother->end_known[end] = true;
	smoother->wires->end[end] = (struct wire_end){
		.piece = draft->path.run[run].piece,
		.at = in_piece(draft, run, at),
		.key = draft->path.key_in[node],
		.on_seam = draft->path.crossing[node],
	};
}

static enum tw_status cut_into_wires(struct draft *draft, struct tw_error *error)
{
	const struct branch_set *set = draft->smoother->set;
	const struct unfolded *path = &draft->path;
	know_end(draft, draft->strand->end[0], 0, path->leg_run[0], path->point[0]);
	know_end(draft, draft->strand->end[1], path->count - 1, path->leg_run[path->count - 2],
		 path->point[path->count - 1]);
	struct cut from = {0, 0};
	uint32_t node = draft->extended_first;
	for (uint32_t i = 0; i < draft->strand->count; i++) {
		const struct strand_step *step = &set->step[draft->strand->first + i];
		const struct branch *branch = &set->branch[step->branch];
		node += branch->edge_count;
		struct cut to = {draft->span_count ? draft->span_count - 1 : 0, 1};
		if (i + 1 < draft->strand->count && draft->span_count) {
			to = from;
			nearest_on_curve(draft, path->point[node], &to.span, &to.t);
			know_end(draft, branch->end[!step->reversed], node, draft->span[to.span].piece,
				 span_point(&draft->span[to.span], to.t));
		}
		enum tw_status status = take_wire(draft, step, from, to, error);
		if (status)
			return status;
		from = to;
	}
	return TW_OK;
}

static enum tw_status smooth_strand(struct smoother *smoother, const struct strand *strand, struct tw_error *error)
{
	struct draft draft = {.smoother = smoother, .strand = strand};
	struct arena *arena = smoother->arena;
	enum tw_status status = strand_unfold(&draft.path, arena, smoother->network, smoother->set, strand, error);
	if (status)
		return status;
	attach_end(&draft, 0);
	attach_end(&draft, 1);
	draft.stop = ARENA_ARRAY(arena, draft.path.count, bool);
	draft.rate = ARENA_ARRAY(arena, draft.path.count, double);
	double *leeway = ARENA_ARRAY(arena, draft.path.count, double);
	if (!draft.stop || !draft.rate || !leeway)
		return tw_fail_memory(error);
	find_stops(&draft);
	status = slide_crossings(&draft, error);
	if (status)
		return status;
	find_rates(&draft);
	keep_clear(&draft, leeway);
	status = draw(&draft, error);
	if (status)
		return status;
	for (uint32_t i = 0; i < draft.path.count; i++)
		smoother->wires->seam_crossings += draft.path.crossing[i];
	return cut_into_wires(&draft, error);
}

static enum tw_status find_vertex_rates(struct smoother *smoother, struct tw_error *error)
{
	const struct network *network = smoother->network;
	uint32_t vertices = network->garment->vertex_count;
	if (!smoother->cost_per_mm)
		return TW_OK;
	double *rate = ARENA_ZEROED(smoother->arena, vertices, double);
	if (!rate)
		return tw_fail_memory(error);
	for (uint32_t v = 0; v < vertices; v++) {
		uint32_t first = network->graph.first[v], end = network->graph.first[v + 1];
		for (uint32_t arc = first; arc < end; arc++)
			rate[v] += smoother->cost_per_mm[network->graph.edge[arc]] / (end - first);
	}
	smoother->vertex_rate = rate;
	return TW_OK;
}

enum tw_status wires_smooth(struct wire_set *wires, struct arena *arena, const struct network *network,
			    const struct branch_set *set, const struct outline *outline, const struct locator *locator,
			    const struct wire_rules *rules, const double *cost_per_mm, struct tw_error *error)
{
	*wires = (struct wire_set){0};
	wires->wire = ARENA_ZEROED(arena, set->branch_count, struct wire);
	wires->end = ARENA_ZEROED(arena, set->end_count, struct wire_end);
	struct smoother smoother = {.wires = wires,
				    .arena = arena,
				    .network = network,
				    .set = set,
				    .outline = outline,
				    .locator = locator,
				    .rules = rules,
				    .cost_per_mm = cost_per_mm};
	smoother.end_known = ARENA_ZEROED(arena, set->end_count, bool);
	if (!wires->wire || !wires->end || !smoother.end_known)
		return tw_fail_memory(error);
	enum tw_status status = find_vertex_rates(&smoother, error);
	if (status)
		return status;
	for (uint32_t s = 0; s < set->strand_count; s++) {
		status = smooth_strand(&smoother, &set->strand[s], error);
		if (status)
			return status;
	}
	/* A lone terminal has no wire; it lies where it is. */
	for (uint32_t e = 0; e < set->end_count; e++) {
		if (smoother.end_known[e])
			continue;
		struct place place = network_place(network, set->end[e].node);
		wires->end[e] = (struct wire_end){.piece = network->garment->face_piece[place.face],
						  .at = place_on_pattern(network->garment, &place)};
	}
	return TW_OK;
}
