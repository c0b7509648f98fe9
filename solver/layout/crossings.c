/* A crossing is judged by the length of the way over it from a point some way before to one some way behind, in the
 * plane in which the two pieces are laid against each other along the seam edge that is crossed: the shortest way is
 * the straight one. Candidates are tried on the seam's edges to both sides of the tree's own crossing. */
#include "solver/layout/crossings.h"

enum { PLACES = 4 };                /* candidates on an edge */
static const double view_mm = 30;   /* length of path before and behind that a crossing is judged by */
static const double inertia = 0.02; /* mm of way that a millimetre of slide must save */

struct slider {
	struct unfolded *path;
	const struct network *network;
	const struct outline *outline;
	const struct crossing_rules *rules;
	uint32_t node;                   /* the crossing */
	uint32_t in_run;                 /* the run before it; the next is the one behind */
	struct vec2 before;              /* on the path, in the plane of the strand */
	struct vec2 behind;              /* on the path, in the plane of the piece behind */
	double best;                     /* cost of the best crossing so far */
	struct vec2 best_point;          /* in the plane of the strand */
	struct placement best_placement; /* of the piece behind */
};

static struct vec2 coord_of(const struct network *network, uint32_t coord)
{
	const double *uv = &network->garment->pattern[2 * (size_t)coord];
	return (struct vec2){uv[0], uv[1]};
}

/* The pattern positions across the seam, in the direction of `segment`; false where another piece lies there. */
static bool other_side(const struct slider *slider, const struct outline_segment *segment, uint32_t *from, uint32_t *to)
{
	const struct topology *topology = slider->network->topology;
	const struct garment *garment = slider->network->garment;
	const uint32_t *pair = &topology->edge_face[2 * (size_t)segment->edge];
	uint32_t side = pair[0] == segment->face ? 1 : 0, face = pair[side];
	/* A face sewn to itself would be both. */
	if (segment->seam == GARMENT_NONE || face == GARMENT_NONE || pair[0] == pair[1])
		return false;
	uint32_t k = topology->edge_side[2 * (size_t)segment->edge + side];
	const uint32_t *coord = &garment->face_coord[3 * (size_t)face];
	/* The face behind walks its side the other way round. */
	*from = coord[(k + 1) % 3];
	*to = coord[k];
	return garment->face_piece[face] == slider->path->run[slider->in_run + 1].piece;
}

/* The piece behind, laid against the strand along a seam edge. */
static struct placement lay_against(const struct slider *slider, struct vec2 here[2], struct vec2 there[2],
				    struct vec2 at_here, struct vec2 at_there)
{
	struct placement in = slider->path->run[slider->in_run].placement;
	struct vec2 a = vec2_unit(vec2_sub(here[1], here[0])), b = vec2_unit(vec2_sub(there[1], there[0]));
	struct vec2 turn = {vec2_dot(b, a), vec2_cross(b, a)};
	struct placement placement = {.rotation = vec2_unit(vec2_rotate(in.rotation, turn))};
	placement.shift = vec2_sub(placement_apply(in, at_here), vec2_rotate(at_there, placement.rotation));
	return placement;
}

static double way(const struct slider *slider, struct vec2 point, struct placement behind)
{
	return vec2_distance(slider->before, point) + vec2_distance(point, placement_apply(behind, slider->behind));
}

/* What it costs to cross within a clearance of the seam's end, `to_end` mm away. */
static double crowding(const struct slider *slider, double to_end)
{
	double lack = slider->rules->clearance_mm - to_end;
	return lack > 0 ? lack : 0;
}

/* Tries the places of one segment, which begins `slid` mm from the tree's crossing; `forward` is away from it. */
static void try_segment(struct slider *slider, uint32_t index, bool forward, double slid, double to_end)
{
	const struct outline_segment *segment = &slider->outline->segment[index];
	uint32_t from, to;
	if (!other_side(slider, segment, &from, &to))
		return;
	struct vec2 here[2] = {coord_of(slider->network, segment->from), coord_of(slider->network, segment->to)};
	struct vec2 there[2] = {coord_of(slider->network, from), coord_of(slider->network, to)};
	double length = vec2_distance(here[0], here[1]);
	for (int i = 0; i < PLACES; i++) {
		double share = (i + 0.5) / PLACES, t = forward ? share : 1 - share;
		struct vec2 at_here = vec2_mix(here[0], here[1], t), at_there = vec2_mix(there[0], there[1], t);
		double distance = slid + share * length;
		if (distance > slider->rules->reach_mm)
			break;
		struct placement placement = lay_against(slider, here, there, at_here, at_there);
		struct vec2 point = placement_apply(slider->path->run[slider->in_run].placement, at_here);
		double cost =
			way(slider, point, placement) + inertia * distance + crowding(slider, to_end - share * length);
		if (cost >= slider->best)
			continue;
		slider->best = cost;
		slider->best_point = point;
		slider->best_placement = placement;
	}
}

/* The loop that a segment belongs to. */
static const struct outline_loop *loop_of(const struct outline *outline, uint32_t segment)
{
	for (uint32_t l = 0; l < outline->loop_count; l++)
		if (segment - outline->loop[l].first < outline->loop[l].count)
			return &outline->loop[l];
	return NULL;
}

static uint32_t neighbour(const struct outline_loop *loop, uint32_t segment, bool forward)
{
	uint32_t i = segment - loop->first;
	return loop->first + (forward ? i + 1 : i + loop->count - 1) % loop->count;
}

/* How far the seam goes on from the beginning of `segment`, no farther than asked. */
static double seam_length(const struct slider *slider, uint32_t segment, bool forward, double most)
{
	const struct outline *outline = slider->outline;
	const struct outline_loop *loop = loop_of(outline, segment);
	uint32_t seam = outline->segment[segment].seam;
	double length = 0;
	for (uint32_t n = 0; n < loop->count && length < most && outline->segment[segment].seam == seam; n++) {
		length += vec2_distance(coord_of(slider->network, outline->segment[segment].from),
					coord_of(slider->network, outline->segment[segment].to));
		segment = neighbour(loop, segment, forward);
	}
	return length;
}

/* Goes along the seam from the tree's crossing. */
static void try_direction(struct slider *slider, uint32_t segment, bool forward)
{
	const struct outline *outline = slider->outline;
	const struct outline_loop *loop = loop_of(outline, segment);
	double reach = slider->rules->reach_mm, most = reach + 2 * slider->rules->clearance_mm, slid = 0;
	uint32_t seam = outline->segment[segment].seam;
	if (seam == GARMENT_NONE)
		return;
	double to_end = seam_length(slider, segment, forward, most);
	for (uint32_t n = 0; n < loop->count && slid < reach && outline->segment[segment].seam == seam; n++) {
		try_segment(slider, segment, forward, slid, to_end - slid);
		slid += vec2_distance(coord_of(slider->network, outline->segment[segment].from),
				      coord_of(slider->network, outline->segment[segment].to));
		segment = neighbour(loop, segment, forward);
	}
}

/* A node of the same run, some way before (step -1) or behind the crossing. */
static struct vec2 look(const struct slider *slider, int step)
{
	const struct unfolded *path = slider->path;
	uint32_t run = step < 0 ? slider->in_run : slider->in_run + 1, at = slider->node;
	double length = 0;
	for (;;) {
		uint32_t leg = step < 0 ? at - 1 : at, next = step < 0 ? at - 1 : at + 1;
		if ((step < 0 ? at == 0 : at + 1 == path->count) || path->leg_run[leg] != run || length >= view_mm)
			return path->point[at];
		length += vec2_distance(path->point[at], path->point[next]);
		at = next;
	}
}

/* Moves everything behind the crossing rigidly along with the piece behind. */
static void move_rest(struct slider *slider)
{
	struct unfolded *path = slider->path;
	uint32_t first = slider->in_run + 1;
	struct placement old = path->run[first].placement, fresh = slider->best_placement;
	path->point[slider->node] = slider->best_point;
	for (uint32_t i = slider->node + 1; i < path->count; i++)
		path->point[i] = placement_apply(fresh, placement_undo(old, path->point[i]));
	for (uint32_t r = first; r < path->run_count; r++) {
		struct placement *run = &path->run[r].placement;
		struct vec2 back = {old.rotation.x, -old.rotation.y};
		struct vec2 turn = vec2_rotate(fresh.rotation, back);
		run->shift = placement_apply(fresh, placement_undo(old, run->shift));
		run->rotation = vec2_unit(vec2_rotate(run->rotation, turn));
	}
}

/* The path near the crossing is drawn along with it, less and less with the distance, so that it does not double back.
 */
static void drag(struct slider *slider, int step, struct vec2 shift)
{
	struct unfolded *path = slider->path;
	uint32_t run = step < 0 ? slider->in_run : slider->in_run + 1, at = slider->node;
	double fade = view_mm + 2 * vec2_length(shift), length = 0;
	struct vec2 last = vec2_sub(path->point[at], shift);
	for (;;) {
		uint32_t leg = step < 0 ? at - 1 : at, next = step < 0 ? at - 1 : at + 1;
		bool end = step < 0 ? next == 0 : next + 1 == path->count;
		if (end || path->leg_run[leg] != run || path->crossing[next])
			return;
		length += vec2_distance(last, path->point[next]);
		if (length >= fade)
			return;
		last = path->point[next];
		path->point[next] = vec2_along(last, shift, 1 - length / fade);
		at = next;
	}
}

static void slide(struct slider *slider)
{
	struct unfolded *path = slider->path;
	struct placement behind = path->run[slider->in_run + 1].placement;
	slider->before = look(slider, -1);
	slider->behind = placement_undo(behind, look(slider, 1));
	slider->best_point = path->point[slider->node];
	slider->best_placement = behind;
	const struct outline *outline = slider->outline;
	uint32_t piece = path->run[slider->in_run].piece;
	double most = 2 * slider->rules->clearance_mm, to_end = most;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		bool forward = outline->segment[i].from == path->key_in[slider->node];
		uint32_t from, to;
		if (!forward && outline->segment[i].to != path->key_in[slider->node])
			continue;
		/* Where only one side of the crossing is this seam, it stands at the seam's end. */
		bool ours = other_side(slider, &outline->segment[i], &from, &to);
		double length = ours ? seam_length(slider, i, forward, most) : 0;
		to_end = length < to_end ? length : to_end;
	}
	slider->best = way(slider, slider->best_point, behind) + crowding(slider, to_end);
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		if (outline->segment[i].from == path->key_in[slider->node])
			try_direction(slider, i, true);
		else if (outline->segment[i].to == path->key_in[slider->node])
			try_direction(slider, i, false);
	}
	struct vec2 start = path->point[slider->node];
	struct vec2 start_behind = placement_undo(behind, start);
	move_rest(slider);
	drag(slider, -1, vec2_sub(slider->best_point, start));
	drag(slider, 1, vec2_sub(slider->best_point, placement_apply(slider->best_placement, start_behind)));
}

void crossings_slide(struct unfolded *path, const struct network *network, const struct outline *outline,
		     const bool *pinned, const struct crossing_rules *rules)
{
	for (uint32_t i = 1; i + 1 < path->count; i++) {
		if (!path->crossing[i] || pinned[i] || path->leg_run[i] != path->leg_run[i - 1] + 1)
			continue;
		struct slider slider = {.path = path,
					.network = network,
					.outline = outline,
					.rules = rules,
					.node = i,
					.in_run = path->leg_run[i - 1]};
		slide(&slider);
	}
}
