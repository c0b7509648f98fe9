/* A strand is unfolded into one plane, its crossings moved to where the way is straight, kept clear of the cut lines,
 * drawn as a curve (draft.c), and folded back onto its pieces; then it is cut into its branches at the junctions. A
 * strand that ends at a junction ends on the curve of the strand that runs through, which is why strands are taken in
 * that order. */
#include "solver/layout/wires.h"

#include "solver/layout/crossings.h"
#include "solver/layout/draft.h"

#include <string.h>

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

static void find_junctions(struct draft *draft)
{
	const struct branch_set *set = draft->smoother->set;
	uint32_t node = draft->extended_first;
	for (uint32_t i = 0; i + 1 < draft->strand->count; i++) {
		node += set->branch[set->step[draft->strand->first + i].branch].edge_count;
		draft->junction[node] = true;
	}
}

/* Crossings at junctions stay where they are, because other strands meet there. */
static void slide_crossings(struct draft *draft)
{
	const struct smoother *smoother = draft->smoother;
	const struct crossing_rules rules = {.reach_mm = smoother->rules->tolerance_mm,
					     .clearance_mm = smoother->rules->clearance_mm};
	crossings_slide(&draft->path, smoother->network, smoother->outline, draft->junction, &rules);
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
		struct vec2 point = draft_in_piece(draft, run, path->point[i]);
		struct vec2 moved = move_inwards(draft, path->run[run].piece, point, clearance);
		double distance = vec2_distance(point, moved), most = draft_held_mm(draft);
		if (distance > most)
			moved = vec2_mix(point, moved, most / distance);
		if (!draft->stop[i])
			path->point[i] = placement_apply(path->run[run].placement, moved);
	}
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

/* Where a strand is cut into branches. */
struct cut {
	uint32_t span;
	double t;
	uint32_t node; /* of the path, which is cut there, too */
};

/* Notes where a part of the branch's curve is farthest from legs first…end - 1 of the tree's path. */
static void look_for_stray(const struct draft *draft, const struct span *part, uint32_t first, uint32_t end,
			   struct wire_stray *stray)
{
	static const double step_mm = 0.5;
	uint32_t steps = (uint32_t)(span_length(part) / step_mm) + 1;
	for (uint32_t i = 0; i <= steps; i++) {
		struct vec2 point = span_point(part, (double)i / steps);
		double distance = draft_stray(draft, first, end, point);
		if (distance <= stray->distance_mm)
			continue;
		*stray = (struct wire_stray){distance, draft->path.run[part->piece].piece,
					     draft_in_piece(draft, part->piece, point)};
	}
}

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
		look_for_stray(draft, &part, from.node, to.node, &wire->stray);
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
		.at = draft_in_piece(draft, run, at),
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
	const struct cut end = {draft->span_count ? draft->span_count - 1 : 0, 1, path->count - 1};
	struct cut from = {0, 0, 0};
	uint32_t node = draft->extended_first;
	for (uint32_t i = 0; i < draft->strand->count; i++) {
		const struct strand_step *step = &set->step[draft->strand->first + i];
		const struct branch *branch = &set->branch[step->branch];
		struct cut to = end;
		node += branch->edge_count;
		if (i + 1 < draft->strand->count && draft->span_count) {
			to = (struct cut){from.span, from.t, node};
			nearest_on_curve(draft, path->point[node], &to.span, &to.t);
			know_end(draft, branch->end[!step->reversed], node, draft->span[to.span].piece,
				 span_point(&draft->span[to.span], to.t));
		}
		enum tw_status status = take_wire(draft, step, from, to, error);
		if (status != TW_OK)
			return status;
		from = to;
	}
	return TW_OK;
}

/* The tree's own path, laid anew where crossings have moved. */
static void lay_tree(struct draft *draft)
{
	const struct unfolded *path = &draft->path;
	for (uint32_t leg = 0; leg + 1 < path->count; leg++) {
		struct placement placement = path->run[path->leg_run[leg]].placement;
		draft->tree[leg][0] = placement_apply(placement, path->leg_from[leg]);
		draft->tree[leg][1] = placement_apply(placement, path->leg_to[leg]);
	}
}

/* How a strand is drawn: as boldly as the rules allow, and nearer to the tree's path where that breaks rules. The
 * path's own strips are clear of what is kept out. */
struct manner {
	bool moves_path;        /* crossings slide, the path keeps clear of cut lines */
	double tolerance_share; /* of the rules' tolerance, for straightening */
};

static enum tw_status draw_strand(struct draft *draft, const struct manner *manner, struct tw_error *error)
{
	struct smoother *smoother = draft->smoother;
	struct arena *arena = smoother->arena;
	enum tw_status status =
		strand_unfold(&draft->path, arena, smoother->network, smoother->set, draft->strand, error);
	if (status != TW_OK)
		return status;
	attach_end(draft, 0);
	attach_end(draft, 1);
	draft->stop = ARENA_ARRAY(arena, draft->path.count, bool);
	draft->junction = ARENA_ZEROED(arena, draft->path.count, bool);
	draft->rate = ARENA_ARRAY(arena, draft->path.count, double);
	draft->tree = arena_array(arena, draft->path.count, sizeof *draft->tree);
	draft->tolerance_mm = manner->tolerance_share * smoother->rules->tolerance_mm;
	double *leeway = ARENA_ARRAY(arena, draft->path.count, double);
	if (!draft->stop || !draft->junction || !draft->rate || !draft->tree || !leeway)
		return tw_fail_memory(error);
	find_stops(draft);
	find_junctions(draft);
	if (manner->moves_path)
		slide_crossings(draft);
	find_rates(draft);
	lay_tree(draft);
	if (manner->moves_path)
		keep_clear(draft, leeway);
	return draft_draw(draft, error);
}

static enum tw_status smooth_strand(struct smoother *smoother, const struct strand *strand, struct tw_error *error)
{
	static const struct manner manners[] = {{true, 0.5}, {true, 0.25}, {false, 0.25}, {false, 0.05}};
	struct draft best = {.smoother = smoother, .strand = strand};
	enum tw_status status = draw_strand(&best, &manners[0], error);
	for (size_t m = 1; m < sizeof manners / sizeof *manners && status == TW_OK && best.badness > 0; m++) {
		struct draft draft = {.smoother = smoother, .strand = strand};
		status = draw_strand(&draft, &manners[m], error);
		if (status == TW_OK && draft.badness < best.badness)
			best = draft;
	}
	if (status != TW_OK)
		return status;
	for (uint32_t i = 0; i < best.path.count; i++)
		smoother->wires->seam_crossings += best.path.crossing[i];
	return cut_into_wires(&best, error);
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
	if (status != TW_OK)
		return status;
	for (uint32_t s = 0; s < set->strand_count; s++) {
		status = smooth_strand(&smoother, &set->strand[s], error);
		if (status != TW_OK)
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
