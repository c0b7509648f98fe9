#include "solver/curve/region.h"

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Coordinates keep below 2^28 units and are doubled where midpoints are asked for, so that every product of two
 * differences fits 62 bits. */
#define EXTENT_UNITS 0x1p28

enum { ROUNDS = 8 }; /* of splitting: rounded cuts can meet others anew; two rounds have always been enough */

struct spot {
	int64_t x, y;
};

/* An edge of either area. After merging from < to, and `wind` is how much the winding number of each area is higher on
 * its left. */
struct edge {
	struct spot from, to;
	int wind[2];
};

struct combiner {
	struct arena *arena;
	struct edge *edge; /* [edge_count]: those near both areas, split; [near_count, edge_count): far ones, whole */
	uint32_t edge_count, near_count;
	struct vec2 origin;
	double unit; /* mm */
	enum region_operation operation;
};

static int compare_spots(struct spot a, struct spot b)
{
	if (a.x != b.x)
		return a.x < b.x ? -1 : 1;
	return a.y < b.y ? -1 : a.y > b.y;
}

static int compare_edges(const void *a, const void *b)
{
	const struct edge *p = a, *q = b;
	int order = compare_spots(p->from, q->from);
	return order ? order : compare_spots(p->to, q->to);
}

static bool same_spot(struct spot a, struct spot b)
{
	return a.x == b.x && a.y == b.y;
}

/* Positive where c lies to the left of a-b. */
static int64_t side_of(struct spot a, struct spot b, struct spot c)
{
	return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static int64_t lower(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static int64_t higher(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

/* --- into integers ------------------------------------------------------------------------------------------------ */

static void widen(struct vec2 *low, struct vec2 *high, const struct region *region)
{
	for (uint32_t i = 0; i < region->first[region->loop_count]; i++) {
		low->x = fmin(low->x, region->point[i].x);
		low->y = fmin(low->y, region->point[i].y);
		high->x = fmax(high->x, region->point[i].x);
		high->y = fmax(high->y, region->point[i].y);
	}
}

static void choose_grid(struct combiner *combiner, const struct region *a, const struct region *b)
{
	struct vec2 low = {INFINITY, INFINITY}, high = {-INFINITY, -INFINITY};
	widen(&low, &high, a);
	widen(&low, &high, b);
	double extent = fmax(high.x - low.x, high.y - low.y);
	combiner->unit = REGION_GRID_MM;
	while (extent / combiner->unit > EXTENT_UNITS && isfinite(extent))
		combiner->unit *= 2;
	/* The origin is a point of the grid, so that a point is rounded alike whatever it is combined with. */
	combiner->origin = (struct vec2){floor(low.x / combiner->unit), floor(low.y / combiner->unit)};
}

static struct spot spot_of(const struct combiner *combiner, struct vec2 point)
{
	return (struct spot){(int64_t)(floor(point.x / combiner->unit + 0.5) - combiner->origin.x),
			     (int64_t)(floor(point.y / combiner->unit + 0.5) - combiner->origin.y)};
}

static struct vec2 point_of(const struct combiner *combiner, struct spot spot)
{
	return (struct vec2){((double)spot.x + combiner->origin.x) * combiner->unit,
			     ((double)spot.y + combiner->origin.y) * combiner->unit};
}

static void list_edges(struct combiner *combiner, const struct region *region, int which)
{
	for (uint32_t l = 0; l < region->loop_count; l++) {
		uint32_t first = region->first[l], end = region->first[l + 1];
		for (uint32_t i = first; i < end; i++) {
			struct edge edge = {.from = spot_of(combiner, region->point[i]),
					    .to = spot_of(combiner, region->point[i + 1 < end ? i + 1 : first])};
			edge.wind[which] = 1;
			if (!same_spot(edge.from, edge.to))
				combiner->edge[combiner->edge_count++] = edge;
		}
	}
}

/* The result lies within a: edges of b that stay outside a's box bound nothing and are cut by nothing. They come last.
 */
static void part_far_edges(struct combiner *combiner, uint32_t count_a)
{
	if (!count_a)
		return;
	struct spot low = combiner->edge[0].from, high = low;
	for (uint32_t i = 0; i < count_a; i++) {
		struct spot p = combiner->edge[i].from;
		low = (struct spot){lower(low.x, p.x), lower(low.y, p.y)};
		high = (struct spot){higher(high.x, p.x), higher(high.y, p.y)};
	}
	combiner->near_count = count_a;
	for (uint32_t i = count_a; i < combiner->edge_count; i++) {
		struct edge edge = combiner->edge[i];
		if (higher(edge.from.x, edge.to.x) < low.x || lower(edge.from.x, edge.to.x) > high.x ||
		    higher(edge.from.y, edge.to.y) < low.y || lower(edge.from.y, edge.to.y) > high.y)
			continue;
		combiner->edge[i] = combiner->edge[combiner->near_count];
		combiner->edge[combiner->near_count++] = edge;
	}
}

/* --- splitting ---------------------------------------------------------------------------------------------------- */

/* A place at which an edge is to be split. */
struct split {
	uint32_t edge;
	int64_t order; /* how far along the edge, for sorting */
	struct spot at;
};

struct splits {
	struct split *split;
	uint32_t count, room;
	struct arena *arena;
	bool failed;
};

static void add_split(struct splits *splits, const struct edge *edges, uint32_t index, struct spot at)
{
	const struct edge *edge = &edges[index];
	if (same_spot(at, edge->from) || same_spot(at, edge->to))
		return;
	if (splits->count == splits->room) {
		uint32_t room = splits->room ? 2 * splits->room : 256;
		struct split *more = ARENA_ARRAY(splits->arena, room, struct split);
		if (!more || room <= splits->room) {
			splits->failed = true;
			return;
		}
		if (splits->count)
			memcpy(more, splits->split, splits->count * sizeof *more);
		splits->split = more;
		splits->room = room;
	}
	int64_t dx = edge->to.x - edge->from.x, dy = edge->to.y - edge->from.y;
	int64_t order = (at.x - edge->from.x) * dx + (at.y - edge->from.y) * dy;
	splits->split[splits->count++] = (struct split){index, order, at};
}

static bool within_box(const struct edge *edge, struct spot p)
{
	return p.x >= lower(edge->from.x, edge->to.x) && p.x <= higher(edge->from.x, edge->to.x) &&
	       p.y >= lower(edge->from.y, edge->to.y) && p.y <= higher(edge->from.y, edge->to.y);
}

static void split_pair(struct splits *splits, const struct edge *edges, uint32_t i, uint32_t j)
{
	const struct edge *a = &edges[i], *b = &edges[j];
	int64_t b_from = side_of(a->from, a->to, b->from), b_to = side_of(a->from, a->to, b->to);
	if ((b_from > 0 && b_to > 0) || (b_from < 0 && b_to < 0))
		return;
	int64_t a_from = side_of(b->from, b->to, a->from), a_to = side_of(b->from, b->to, a->to);
	if ((a_from > 0 && a_to > 0) || (a_from < 0 && a_to < 0))
		return;
	/* Ends that lie on the other edge; of edges on one line these are all. */
	if (b_from == 0 && within_box(a, b->from))
		add_split(splits, edges, i, b->from);
	if (b_to == 0 && within_box(a, b->to))
		add_split(splits, edges, i, b->to);
	if (a_from == 0 && within_box(b, a->from))
		add_split(splits, edges, j, a->from);
	if (a_to == 0 && within_box(b, a->to))
		add_split(splits, edges, j, a->to);
	if (b_from == 0 || b_to == 0 || a_from == 0 || a_to == 0)
		return;
	double t = (double)b_from / ((double)b_from - (double)b_to);
	struct spot at = {b->from.x + (int64_t)floor(t * (double)(b->to.x - b->from.x) + 0.5),
			  b->from.y + (int64_t)floor(t * (double)(b->to.y - b->from.y) + 0.5)};
	add_split(splits, edges, i, at);
	add_split(splits, edges, j, at);
}

static int compare_left(const void *a, const void *b)
{
	const struct edge *p = a, *q = b;
	int64_t left = lower(p->from.x, p->to.x), other = lower(q->from.x, q->to.x);
	if (left != other)
		return left < other ? -1 : 1;
	return compare_edges(a, b);
}

static void find_splits(const struct combiner *combiner, struct splits *splits)
{
	struct edge *edge = combiner->edge;
	qsort(edge, combiner->near_count, sizeof *edge, compare_left);
	for (uint32_t i = 0; i < combiner->near_count; i++) {
		int64_t right = higher(edge[i].from.x, edge[i].to.x);
		int64_t bottom = lower(edge[i].from.y, edge[i].to.y), top = higher(edge[i].from.y, edge[i].to.y);
		for (uint32_t j = i + 1; j < combiner->near_count; j++) {
			if (lower(edge[j].from.x, edge[j].to.x) > right)
				break;
			if (higher(edge[j].from.y, edge[j].to.y) >= bottom &&
			    lower(edge[j].from.y, edge[j].to.y) <= top)
				split_pair(splits, edge, i, j);
		}
	}
}

static int compare_splits(const void *a, const void *b)
{
	const struct split *p = a, *q = b;
	if (p->edge != q->edge)
		return p->edge < q->edge ? -1 : 1;
	if (p->order != q->order)
		return p->order < q->order ? -1 : 1;
	return compare_spots(p->at, q->at);
}

/* The near edges in parts; the far ones follow as they are. */
static bool apply_splits(struct combiner *combiner, struct splits *splits)
{
	struct edge *fresh = ARENA_ARRAY(combiner->arena, (size_t)combiner->edge_count + splits->count, struct edge);
	if (!fresh)
		return false;
	qsort(splits->split, splits->count, sizeof *splits->split, compare_splits);
	uint32_t count = 0, s = 0;
	for (uint32_t i = 0; i < combiner->near_count; i++) {
		struct edge rest = combiner->edge[i];
		for (; s < splits->count && splits->split[s].edge == i; s++) {
			struct edge part = rest;
			if (same_spot(splits->split[s].at, rest.from))
				continue;
			part.to = rest.from = splits->split[s].at;
			fresh[count++] = part;
		}
		if (!same_spot(rest.from, rest.to))
			fresh[count++] = rest;
	}
	uint32_t far = combiner->edge_count - combiner->near_count;
	memcpy(fresh + count, combiner->edge + combiner->near_count, far * sizeof *fresh);
	combiner->edge = fresh;
	combiner->near_count = count;
	combiner->edge_count = count + far;
	return true;
}

static enum tw_status split_edges(struct combiner *combiner, struct tw_error *error)
{
	for (int round = 0; round < ROUNDS; round++) {
		struct splits splits = {.arena = combiner->arena};
		find_splits(combiner, &splits);
		if (splits.failed)
			return tw_fail_memory(error);
		if (!splits.count)
			break;
		if (!apply_splits(combiner, &splits))
			return tw_fail_memory(error);
	}
	return TW_OK;
}

/* --- merging ------------------------------------------------------------------------------------------------------ */

static void turn_forward(struct edge *edge)
{
	if (compare_spots(edge->from, edge->to) <= 0)
		return;
	struct spot swap = edge->from;
	edge->from = edge->to;
	edge->to = swap;
	edge->wind[0] = -edge->wind[0];
	edge->wind[1] = -edge->wind[1];
}

/* Edges that coincide become one; those that bound neither area go. */
static void merge_edges(struct combiner *combiner)
{
	struct edge *edge = combiner->edge;
	for (uint32_t i = 0; i < combiner->edge_count; i++)
		turn_forward(&edge[i]);
	qsort(edge, combiner->near_count, sizeof *edge, compare_edges);
	uint32_t kept = 0;
	for (uint32_t i = 0, next; i < combiner->near_count; i = next) {
		struct edge sum = edge[i];
		for (next = i + 1; next < combiner->near_count && !compare_edges(&edge[i], &edge[next]); next++) {
			sum.wind[0] += edge[next].wind[0];
			sum.wind[1] += edge[next].wind[1];
		}
		if (sum.wind[0] || sum.wind[1])
			edge[kept++] = sum;
	}
	memmove(edge + kept, edge + combiner->near_count, (combiner->edge_count - combiner->near_count) * sizeof *edge);
	combiner->edge_count -= combiner->near_count - kept;
	combiner->near_count = kept;
}

/* --- choosing ----------------------------------------------------------------------------------------------------- */

/* The winding numbers just to the right of an edge's middle: below it or, of an upright edge, in +x direction. A ray
 * goes that way; doubled coordinates make the middle a spot. */
static void wind_beside(const struct combiner *combiner, const struct edge *self, int wind[2])
{
	struct spot middle = {self->from.x + self->to.x, self->from.y + self->to.y};
	bool upright = self->from.x == self->to.x;
	wind[0] = wind[1] = 0;
	for (uint32_t i = 0; i < combiner->edge_count; i++) {
		const struct edge *edge = &combiner->edge[i];
		struct spot from = {2 * edge->from.x, 2 * edge->from.y}, to = {2 * edge->to.x, 2 * edge->to.y};
		if (edge == self)
			continue;
		int crossed = 0;
		if (!upright) {
			if (from.x <= middle.x && middle.x < to.x && side_of(from, to, middle) > 0)
				crossed = 1;
		} else if (from.y <= middle.y && middle.y < to.y) {
			crossed = side_of(from, to, middle) > 0 ? 1 : 0;
		} else if (to.y <= middle.y && middle.y < from.y) {
			crossed = side_of(from, to, middle) < 0 ? -1 : 0;
		}
		wind[0] += crossed * edge->wind[0];
		wind[1] += crossed * edge->wind[1];
	}
}

static bool in_result(const struct combiner *combiner, const int wind[2])
{
	return wind[0] > 0 && (wind[1] > 0) == (combiner->operation == REGION_COMMON);
}

/* Keeps the edges that bound the result, directed so that it lies on their left. */
static void choose_edges(struct combiner *combiner, struct edge *chosen, uint32_t *count)
{
	*count = 0;
	for (uint32_t i = 0; i < combiner->near_count; i++) {
		const struct edge *edge = &combiner->edge[i];
		int right[2];
		wind_beside(combiner, edge, right);
		const int left[2] = {right[0] + edge->wind[0], right[1] + edge->wind[1]};
		bool in_left = in_result(combiner, left), in_right = in_result(combiner, right);
		if (in_left == in_right)
			continue;
		chosen[*count] = *edge;
		if (in_right) {
			chosen[*count].from = edge->to;
			chosen[*count].to = edge->from;
		}
		(*count)++;
	}
}

/* --- chaining ----------------------------------------------------------------------------------------------------- */

/* Which quarter the direction lies in, counted clockwise from `back`: 0 for back itself, to 4 for all but back. */
static int quarter_from(struct spot back, struct spot direction)
{
	int64_t cross = back.x * direction.y - back.y * direction.x, dot = back.x * direction.x + back.y * direction.y;
	if (cross == 0)
		return dot > 0 ? 4 : 2;
	return cross < 0 ? (dot > 0 ? 0 : 1) : (dot < 0 ? 2 : 3);
}

/* Whether a comes before b when one turns clockwise from `back`. The area lies on the left of an edge that arrives, so
 * the first that leaves bounds the same part of it. */
static bool comes_before(struct spot back, struct spot a, struct spot b)
{
	int quarter_a = quarter_from(back, a), quarter_b = quarter_from(back, b);
	if (quarter_a != quarter_b)
		return quarter_a < quarter_b;
	return a.x * b.y - a.y * b.x < 0;
}

static struct spot minus(struct spot a, struct spot b)
{
	return (struct spot){a.x - b.x, a.y - b.y};
}

/* The first of the edges that leave a spot; they stand in order of `from`. */
static uint32_t row_of(const struct edge *edge, uint32_t count, struct spot at)
{
	uint32_t low = 0, high = count;
	while (low < high) {
		uint32_t middle = (low + high) / 2;
		if (compare_spots(edge[middle].from, at) < 0)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static uint32_t next_edge(const struct edge *edge, uint32_t count, const bool *used, uint32_t at)
{
	uint32_t best = UINT32_MAX;
	struct spot back = minus(edge[at].from, edge[at].to);
	for (uint32_t i = row_of(edge, count, edge[at].to); i < count && same_spot(edge[i].from, edge[at].to); i++) {
		if (used[i])
			continue;
		if (best == UINT32_MAX ||
		    comes_before(back, minus(edge[i].to, edge[i].from), minus(edge[best].to, edge[best].from)))
			best = i;
	}
	return best;
}

/* Whether b is no corner between a and c: at most a grid's width from the straight way. */
static bool is_straight(struct spot a, struct spot b, struct spot c)
{
	int64_t dx = c.x - a.x, dy = c.y - a.y, off = side_of(a, c, b);
	int64_t length = higher(dx < 0 ? -dx : dx, dy < 0 ? -dy : dy);
	struct spot in = minus(b, a), out = minus(c, b);
	return in.x * out.x + in.y * out.y > 0 && (off < 0 ? -off : off) <= length;
}

static uint32_t drop_straight(struct spot *spot, uint32_t count)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < count; i++) {
		struct spot next = spot[i + 1 < count ? i + 1 : 0];
		if (kept > 0 && is_straight(spot[kept - 1], spot[i], next))
			continue;
		spot[kept++] = spot[i];
	}
	return kept;
}

static enum tw_status chain_edges(struct combiner *combiner, struct region *result, struct edge *edge, uint32_t count,
				  struct tw_error *error)
{
	struct spot *spot = ARENA_ARRAY(combiner->arena, (size_t)count + 1, struct spot);
	bool *used = ARENA_ZEROED(combiner->arena, (size_t)count + 1, bool);
	if (!spot || !used)
		return tw_fail_memory(error);
	qsort(edge, count, sizeof *edge, compare_edges);
	uint32_t points = 0;
	for (uint32_t start = 0; start < count; start++) {
		uint32_t length = 0;
		for (uint32_t at = start; at != UINT32_MAX && !used[at]; at = next_edge(edge, count, used, at)) {
			used[at] = true;
			spot[length++] = edge[at].from;
		}
		length = drop_straight(spot, length);
		if (length < 3)
			continue;
		for (uint32_t i = 0; i < length; i++)
			result->point[points++] = point_of(combiner, spot[i]);
		result->first[++result->loop_count] = points;
	}
	return TW_OK;
}

static enum tw_status find_result(struct combiner *combiner, struct region *result, struct arena *arena,
				  struct tw_error *error)
{
	uint32_t count;
	merge_edges(combiner);
	struct edge *chosen = ARENA_ARRAY(combiner->arena, (size_t)combiner->near_count + 1, struct edge);
	if (!chosen)
		return tw_fail_memory(error);
	choose_edges(combiner, chosen, &count);
	result->point = ARENA_ARRAY(arena, count, struct vec2);
	result->first = ARENA_ZEROED(arena, (size_t)count / 3 + 1, uint32_t);
	if (!result->point || !result->first)
		return tw_fail_memory(error);
	return chain_edges(combiner, result, chosen, count, error);
}

enum tw_status region_combine(struct region *result, struct arena *arena, struct arena *scratch, const struct region *a,
			      const struct region *b, enum region_operation operation, struct tw_error *error)
{
	assert(arena != scratch);
	struct combiner combiner = {.arena = scratch, .operation = operation};
	uint32_t count_a = a->first[a->loop_count], count_b = b->first[b->loop_count];
	struct arena_mark mark = arena_mark(scratch);
	combiner.edge = ARENA_ARRAY(scratch, (size_t)count_a + count_b, struct edge);
	if (!combiner.edge)
		return tw_fail_memory(error);
	*result = (struct region){0};
	choose_grid(&combiner, a, b);
	list_edges(&combiner, a, 0);
	uint32_t near = combiner.edge_count;
	list_edges(&combiner, b, 1);
	part_far_edges(&combiner, near);
	enum tw_status status = split_edges(&combiner, error);
	if (status == TW_OK)
		status = find_result(&combiner, result, arena, error);
	arena_release(scratch, mark);
	return status;
}

double region_loop_area(const struct region *region, uint32_t loop, struct vec2 *centroid)
{
	uint32_t first = region->first[loop], end = region->first[loop + 1];
	struct vec2 base = first < end ? region->point[first] : (struct vec2){0, 0}, sum = {0, 0};
	double twice = 0;
	for (uint32_t i = first + 1; i + 1 < end; i++) {
		struct vec2 p = vec2_sub(region->point[i], base), q = vec2_sub(region->point[i + 1], base);
		double cross = vec2_cross(p, q);
		twice += cross;
		sum = vec2_along(sum, vec2_add(p, q), cross / 3);
	}
	*centroid = twice != 0 ? vec2_along(base, sum, 1 / twice) : base;
	return twice / 2;
}

double region_area(const struct region *region)
{
	double area = 0;
	struct vec2 centroid;
	for (uint32_t l = 0; l < region->loop_count; l++)
		area += region_loop_area(region, l, &centroid);
	return area;
}

/* --- building ----------------------------------------------------------------------------------------------------- */

void region_start(struct region_builder *builder, struct arena *arena)
{
	*builder = (struct region_builder){.arena = arena, .loop_room = 16, .point_room = 64};
	builder->region.first = ARENA_ZEROED(arena, builder->loop_room, uint32_t);
	builder->region.point = ARENA_ARRAY(arena, builder->point_room, struct vec2);
	builder->failed = !builder->region.first || !builder->region.point;
}

/* Twice the room; NULL where there is none. */
static void *grow(struct region_builder *builder, const void *old, uint32_t *room, size_t size)
{
	void *fresh = *room < UINT32_MAX / 2 ? arena_array(builder->arena, 2 * (size_t)*room, size) : NULL;
	if (!fresh) {
		builder->failed = true;
		return NULL;
	}
	memcpy(fresh, old, *room * size);
	*room *= 2;
	return fresh;
}

void region_begin_loop(struct region_builder *builder)
{
	struct region *region = &builder->region;
	if (builder->failed)
		return;
	if (region->loop_count + 1 == builder->loop_room) {
		uint32_t *first = grow(builder, region->first, &builder->loop_room, sizeof *first);
		if (!first)
			return;
		region->first = first;
	}
	region->loop_count++;
	region->first[region->loop_count] = region->first[region->loop_count - 1];
}

void region_add_point(struct region_builder *builder, struct vec2 point)
{
	struct region *region = &builder->region;
	if (builder->failed)
		return;
	assert(region->loop_count);
	uint32_t count = region->first[region->loop_count];
	if (count == builder->point_room) {
		struct vec2 *more = grow(builder, region->point, &builder->point_room, sizeof *more);
		if (!more)
			return;
		region->point = more;
	}
	region->point[count] = point;
	region->first[region->loop_count]++;
}

void region_add(struct region_builder *builder, const struct region *region)
{
	for (uint32_t l = 0; l < region->loop_count; l++) {
		region_begin_loop(builder);
		for (uint32_t i = region->first[l]; i < region->first[l + 1]; i++)
			region_add_point(builder, region->point[i]);
	}
}
