/* Purpose: balls: growing them, taking them out, and distances by reduced costs.
 *
 * Data: every arc stands in the row of the vertex that it enters, with its reduced cost beside it, so that the
 * backward Dijkstra from a terminal reads one row for each vertex it settles. Nothing here costs more than the balls
 * that are touched. Dijkstra's queue is a 4-ary heap of distance << 32 | vertex; vertices at the very distance in hand,
 * and reduced graphs are full of arcs that cost nothing, go to a stack instead.
 *
 * Sound: for s below the radius, which is at most the root's distance, the set {D <= s} holds the terminal and not the
 * root, so it is a cut. An arc u -> v enters it for D[v] <= s < D[u], a length of at most its cost, as D[u] <= D[v] +
 * cost. */
#include "solver/steiner/dual.h"

#include <string.h>

/* --- the queue ---------------------------------------------------------------------------------------------------- */

static inline void queue_push(uint64_t *queue, size_t *count, uint64_t key)
{
	size_t i = (*count)++;
	while (i) {
		size_t parent = (i - 1) >> 2;
		if (queue[parent] <= key)
			break;
		queue[i] = queue[parent];
		i = parent;
	}
	queue[i] = key;
}

static inline uint64_t queue_pop(uint64_t *queue, size_t *count)
{
	uint64_t top = queue[0], last = queue[--*count];
	size_t n = *count, i = 0;
	for (;;) {
		size_t child = 4 * i + 1;
		if (child >= n)
			break;
		size_t least = child, end = child + 4 < n ? child + 4 : n;
		for (size_t c = child + 1; c < end; c++)
			least = queue[c] < queue[least] ? c : least;
		if (queue[least] >= last)
			break;
		queue[i] = queue[least];
		i = least;
	}
	queue[i] = last;
	return top;
}

/* --- setting up --------------------------------------------------------------------------------------------------- */

enum { NEAR_COUNT = 12 };

static uint32_t coarse(const struct dual *dual, uint64_t fine)
{
	uint64_t cost = fine >> dual->coarse_shift;
	return cost < DUAL_FAR ? (uint32_t)cost : DUAL_FAR;
}

static void fill_arcs(struct dual *dual)
{
	const struct instance *instance = dual->instance;
	size_t arcs = 2 * (size_t)instance->edge_count;
	uint32_t *side = dual->stack; /* the first arc seen of each edge */
	memset(side, 0xff, instance->edge_count * sizeof *side);
	for (uint32_t a = 0; a < arcs; a++) {
		uint32_t e = instance->edge[a];
		dual->arc[a] = (struct dual_arc){instance->head[a], coarse(dual, instance->weight[e])};
		if (side[e] == INSTANCE_NONE) {
			side[e] = a;
		} else {
			dual->mate[a] = side[e];
			dual->mate[side[e]] = a;
		}
	}
}

/* Distances between neighbouring Voronoi regions, and from them the nearest terminals of each: a Dijkstra over the
 * small region graph, given as a dense matrix for the few terminals at hand. */
static void find_near(struct dual *dual, const uint32_t *base, const uint32_t *distance, uint32_t *border)
{
	const struct instance *instance = dual->instance;
	uint32_t k = instance->terminal_count;
	memset(border, 0xff, (size_t)k * k * sizeof *border);
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		uint32_t u = instance->ends[2 * e], v = instance->ends[2 * e + 1], a = base[u], b = base[v];
		if (a == b || a == INSTANCE_NONE || b == INSTANCE_NONE)
			continue;
		uint32_t length = distance[u] + coarse(dual, instance->weight[e]) + distance[v];
		if (length < border[(size_t)a * k + b])
			border[(size_t)a * k + b] = border[(size_t)b * k + a] = length;
	}
	for (uint32_t t = 0; t < k; t++) {
		uint32_t *reach = dual->distance, *near = dual->near + (size_t)t * dual->near_count, count = 0;
		for (uint32_t b = 0; b < k; b++)
			reach[b] = border[(size_t)t * k + b];
		reach[t] = 0;
		uint8_t *done = (uint8_t *)dual->stack;
		memset(done, 0, k);
		done[t] = 1;
		while (count < dual->near_count) {
			uint32_t best = t;
			for (uint32_t b = 0; b < k; b++)
				if (!done[b] && (best == t || reach[b] < reach[best]))
					best = b;
			done[best] = 1;
			near[count++] = best;
			if (reach[best] == UINT32_MAX)
				continue;
			for (uint32_t b = 0; b < k; b++) {
				uint32_t hop = border[(size_t)best * k + b];
				if (hop != UINT32_MAX && reach[best] + hop < reach[b])
					reach[b] = reach[best] + hop;
			}
		}
		dual->near_distance[t] = count ? reach[near[0]] : 0;
	}
	memset(dual->distance, 0xff, k * sizeof *dual->distance);
}

static enum tw_status survey_neighbours(struct dual *dual, struct search *search)
{
	const struct instance *instance = dual->instance;
	size_t n = instance->vertex_count, k = instance->terminal_count;
	struct arena_mark mark = arena_mark(search->arena);
	uint32_t *base = ARENA_ARRAY(search->arena, n, uint32_t);
	uint32_t *border = ARENA_ARRAY(search->arena, k * k, uint32_t);
	if (!base || !border)
		return TW_ERROR_MEMORY;
	uint32_t *distance = dual->distance;
	size_t count = 0;
	memset(base, 0xff, n * sizeof *base);
	for (uint32_t t = 0; t < k; t++) {
		distance[instance->terminal[t]] = 0;
		base[instance->terminal[t]] = t;
		queue_push(dual->queue, &count, instance->terminal[t]);
	}
	while (count) {
		uint64_t key = queue_pop(dual->queue, &count);
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		if (d != distance[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[a].cost;
			if (longer >= distance[u] || longer >= DUAL_FAR)
				continue;
			distance[u] = longer;
			base[u] = base[v];
			queue_push(dual->queue, &count, (uint64_t)longer << 32 | u);
		}
	}
	uint32_t *kept = ARENA_ARRAY(search->arena, n, uint32_t);
	if (kept) {
		memcpy(kept, distance, n * sizeof *kept);
		memset(distance, 0xff, n * sizeof *distance);
		find_near(dual, base, kept, border);
	}
	search->work += 2 * instance->edge_count;
	arena_release(search->arena, mark);
	return kept ? TW_OK : TW_ERROR_MEMORY;
}

static enum tw_status allocate(struct dual *dual, struct search *search, size_t member_room)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	size_t n = instance->vertex_count, arcs = 2 * (size_t)instance->edge_count, k = instance->terminal_count;
	dual->arena = arena;
	dual->instance = instance;
	dual->near_count = (uint32_t)(k - 1 < NEAR_COUNT ? k - 1 : NEAR_COUNT);
	dual->value = ARENA_ZEROED(arena, k, uint64_t);
	dual->arc = ARENA_ARRAY(arena, arcs, struct dual_arc);
	dual->mate = ARENA_ARRAY(arena, arcs, uint32_t);
	dual->distance = ARENA_ARRAY(arena, n, uint32_t);
	dual->queue = ARENA_ARRAY(arena, arcs + k, uint64_t);
	dual->stack = ARENA_ARRAY(arena, arcs + k, uint32_t);
	dual->near = ARENA_ARRAY(arena, k * dual->near_count, uint32_t);
	dual->near_distance = ARENA_ARRAY(arena, k, uint32_t);
	dual->ball_capacity = (uint32_t)(16 * k + 64);
	dual->ball = ARENA_ARRAY(arena, dual->ball_capacity, struct dual_ball);
	dual->member_capacity = 4 * n + member_room;
	dual->member = ARENA_ARRAY(arena, dual->member_capacity, struct dual_member);
	if (!dual->value || !dual->arc || !dual->mate || !dual->distance || !dual->queue || !dual->stack ||
	    !dual->near || !dual->near_distance || !dual->ball || !dual->member)
		return TW_ERROR_MEMORY;
	memset(dual->distance, 0xff, n * sizeof *dual->distance);
	fill_arcs(dual);
	return TW_OK;
}

enum tw_status dual_init(struct dual *dual, struct search *search, uint32_t root)
{
	*dual = (struct dual){.root = root, .random = 1};
	while (search_cutoff(search) >> dual->coarse_shift >= DUAL_FAR)
		dual->coarse_shift++;
	enum tw_status status = allocate(dual, search, 0);
	return status == TW_OK ? survey_neighbours(dual, search) : status;
}

/* --- distances ---------------------------------------------------------------------------------------------------- */

void dual_from_root(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *from_root)
{
	const struct instance *instance = dual->instance;
	uint64_t *queue = dual->queue;
	size_t count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		from_root[v] = DUAL_FAR;
	from_root[instance->terminal[dual->root]] = 0;
	queue_push(queue, &count, instance->terminal[dual->root]);
	while (count) {
		uint64_t key = queue_pop(queue, &count);
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		if (d != from_root[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[dual->mate[a]].cost;
			if (longer >= from_root[u] || longer >= limit)
				continue;
			from_root[u] = longer;
			queue_push(queue, &count, (uint64_t)longer << 32 | u);
		}
	}
	search->work += 2 * instance->edge_count;
}

void dual_to_terminal(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *to_terminal)
{
	const struct instance *instance = dual->instance;
	uint64_t *queue = dual->queue;
	size_t count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		to_terminal[v] = DUAL_FAR;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (t != dual->root) {
			to_terminal[instance->terminal[t]] = 0;
			queue_push(queue, &count, instance->terminal[t]);
		}
	while (count) {
		uint64_t key = queue_pop(queue, &count);
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		if (d != to_terminal[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[a].cost;
			if (longer >= to_terminal[u] || longer >= limit)
				continue;
			to_terminal[u] = longer;
			queue_push(queue, &count, (uint64_t)longer << 32 | u);
		}
	}
	search->work += 2 * instance->edge_count;
}

/* --- balls -------------------------------------------------------------------------------------------------------- */

static void scatter(const struct dual *dual, const struct dual_ball *ball)
{
	const struct dual_member *member = dual->member + ball->start;
	for (uint32_t i = 0; i < ball->count; i++)
		dual->distance[member[i].vertex] = member[i].distance;
}

static void gather(const struct dual *dual, const struct dual_ball *ball)
{
	const struct dual_member *member = dual->member + ball->start;
	for (uint32_t i = 0; i < ball->count; i++)
		dual->distance[member[i].vertex] = UINT32_MAX;
}

/* Takes the ball's shares from the arcs, or gives them back: `sign` all ones for giving back, 0 for taking.
 * dual->distance holds the distances, or anything not below the radius outside of the ball. */
static void shift_costs(const struct dual *dual, const struct dual_ball *ball, uint32_t sign)
{
	const uint32_t *first = dual->instance->first, *distance = dual->distance;
	const struct dual_member *member = dual->member + ball->start;
	struct dual_arc *arc = dual->arc;
	uint32_t radius = ball->radius;
	for (uint32_t i = 0; i < ball->count; i++) {
		uint32_t v = member[i].vertex, d = member[i].distance, end = first[v + 1];
		for (uint32_t a = first[v]; a < end; a++) {
			uint32_t outer = distance[arc[a].tail];
			outer = outer < radius ? outer : radius;
			uint32_t share = outer > d ? outer - d : 0;
			arc[a].cost -= (share ^ sign) - sign;
		}
	}
}

static void take_out(struct dual *dual, struct search *search, struct dual_ball *ball)
{
	scatter(dual, ball);
	shift_costs(dual, ball, UINT32_MAX);
	gather(dual, ball);
	ball->applied = 0;
	dual->value[ball->terminal] -= ball->radius;
	dual->bound -= ball->radius;
	search->work += 6 * (uint64_t)ball->count;
}

static void put_back(struct dual *dual, struct search *search, struct dual_ball *ball)
{
	scatter(dual, ball);
	shift_costs(dual, ball, 0);
	gather(dual, ball);
	ball->applied = 1;
	dual->value[ball->terminal] += ball->radius;
	dual->bound += ball->radius;
	search->work += 6 * (uint64_t)ball->count;
}

/* Slides the live balls together; returns false when even so there is no room for one more, and no memory for it. */
static int make_room(struct dual *dual)
{
	size_t used = 0;
	uint32_t kept = 0;
	for (uint32_t i = 0; i < dual->ball_count; i++) {
		struct dual_ball *ball = &dual->ball[i];
		if (ball->terminal == INSTANCE_NONE)
			continue;
		memmove(dual->member + used, dual->member + ball->start, ball->count * sizeof *dual->member);
		ball->start = used;
		used += ball->count;
		dual->ball[kept++] = *ball;
	}
	dual->ball_count = kept;
	dual->member_count = used;
	if (2 * kept > dual->ball_capacity) {
		struct dual_ball *larger = ARENA_ARRAY(dual->arena, 2 * (size_t)dual->ball_capacity, struct dual_ball);
		if (!larger)
			return 0;
		memcpy(larger, dual->ball, kept * sizeof *larger);
		dual->ball = larger;
		dual->ball_capacity *= 2;
	}
	if (2 * (used + dual->instance->vertex_count) > dual->member_capacity) {
		struct dual_member *larger = ARENA_ARRAY(dual->arena, 2 * dual->member_capacity, struct dual_member);
		if (!larger)
			return 0;
		memcpy(larger, dual->member, used * sizeof *larger);
		dual->member = larger;
		dual->member_capacity *= 2;
	}
	return 1;
}

/* The distances around the terminal up to the root or `limit`, into the free end of dual->member; returns the radius.
 * Vertices that were reached, but not settled, keep their distance: `*reached` of them are left in queue and stack. */
static uint32_t settle(struct dual *dual, uint32_t terminal, uint32_t limit, struct dual_ball *ball, size_t *queued,
		       size_t *stacked)
{
	const struct instance *instance = dual->instance;
	const uint32_t *first = instance->first;
	const struct dual_arc *arc = dual->arc;
	struct dual_member *member = dual->member + dual->member_count;
	uint32_t *distance = dual->distance, *stack = dual->stack;
	uint64_t *queue = dual->queue;
	uint32_t root = instance->terminal[dual->root], count = 0, d = 0;
	size_t in_queue = 0, in_stack = 0;
	distance[instance->terminal[terminal]] = 0;
	stack[in_stack++] = instance->terminal[terminal];
	for (;;) {
		uint32_t v;
		if (in_stack) {
			v = stack[--in_stack];
		} else if (in_queue) {
			uint64_t key = queue_pop(queue, &in_queue);
			v = (uint32_t)key;
			if (distance[v] != (uint32_t)(key >> 32))
				continue;
			d = distance[v];
		} else {
			d = limit;
			break;
		}
		if (v == root) {
			member[count++] = (struct dual_member){v, d};
			break;
		}
		member[count++] = (struct dual_member){v, d};
		for (uint32_t a = first[v], end = first[v + 1]; a < end; a++) {
			uint32_t u = arc[a].tail, longer = d + arc[a].cost;
			if (longer >= distance[u] || longer >= limit)
				continue;
			distance[u] = longer;
			if (u == root)
				limit = longer + 1;
			if (longer == d)
				stack[in_stack++] = u;
			else
				queue_push(queue, &in_queue, (uint64_t)longer << 32 | u);
		}
	}
	ball->count = count;
	*queued = in_queue;
	*stacked = in_stack;
	return d;
}

/* Grows a ball and takes its shares. `limit`: the largest radius. Returns the radius; 0 leaves no ball. */
static uint32_t grow(struct dual *dual, struct search *search, uint32_t terminal, uint32_t limit)
{
	struct dual_ball ball = {.terminal = terminal, .start = dual->member_count, .applied = 1};
	size_t queued, stacked;
	ball.radius = settle(dual, terminal, limit < DUAL_FAR ? limit : DUAL_FAR, &ball, &queued, &stacked);
	const struct dual_member *member = dual->member + ball.start;
	uint32_t settled = ball.count;
	while (ball.count && member[ball.count - 1].distance >= ball.radius)
		ball.count--;
	if (ball.radius)
		shift_costs(dual, &ball, 0);
	for (uint32_t i = 0; i < settled; i++)
		dual->distance[member[i].vertex] = UINT32_MAX;
	for (size_t i = 0; i < queued; i++)
		dual->distance[(uint32_t)dual->queue[i]] = UINT32_MAX;
	for (size_t i = 0; i < stacked; i++)
		dual->distance[dual->stack[i]] = UINT32_MAX;
	search->work += 12 * (uint64_t)settled + 4;
	if (!ball.radius)
		return 0;
	dual->ball[dual->ball_count++] = ball;
	dual->member_count += ball.count;
	dual->value[terminal] += ball.radius;
	dual->bound += ball.radius;
	return ball.radius;
}

/* --- schedule ----------------------------------------------------------------------------------------------------- */

static uint64_t draw(struct dual *dual, uint64_t below)
{
	dual->random += 0x9e3779b97f4a7c15u;
	uint64_t x = dual->random;
	x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
	x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
	return (x ^ (x >> 31)) % below;
}

static int has_room(struct dual *dual)
{
	return (dual->ball_count < dual->ball_capacity &&
		dual->member_count + dual->instance->vertex_count <= dual->member_capacity) ||
	       make_room(dual);
}

/* Grows the terminals of `group` in turns, each turn up to a common limit on a terminal's value that rises by
 * `factor_percent` from turn to turn (0: no limit at all), until all have reached the root. */
static enum tw_status ascend(struct dual *dual, struct search *search, uint32_t *group, uint32_t count, uint64_t limit,
			     unsigned factor_percent)
{
	while (count) {
		uint32_t left = 0;
		for (uint32_t i = 0; i < count; i++) {
			uint32_t t = group[i];
			uint64_t room =
				factor_percent ? limit - (dual->value[t] < limit ? dual->value[t] : limit) : DUAL_FAR;
			if (room) {
				if (!has_room(dual))
					return TW_ERROR_MEMORY;
				if (grow(dual, search, t, room < DUAL_FAR ? (uint32_t)room : DUAL_FAR) < room)
					continue;
			}
			if (factor_percent)
				group[left++] = t;
		}
		count = left;
		limit += limit * (factor_percent - 100) / 100 + 1;
		if (!search_spend(search, 0))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

static void shuffle(struct dual *dual, uint32_t *group, uint32_t count)
{
	for (uint32_t i = count; i > 1; i--) {
		uint32_t j = (uint32_t)draw(dual, i), t = group[i - 1];
		group[i - 1] = group[j];
		group[j] = t;
	}
}

enum tw_status dual_ascend(struct dual *dual, struct search *search)
{
	uint32_t count = 0, *list = ARENA_ARRAY(dual->arena, dual->instance->terminal_count, uint32_t);
	if (!list)
		return TW_ERROR_MEMORY;
	uint64_t least = UINT32_MAX;
	for (uint32_t t = 0; t < dual->instance->terminal_count; t++)
		if (t != dual->root) {
			list[count++] = t;
			if (dual->near_distance[t] < least)
				least = dual->near_distance[t];
		}
	return ascend(dual, search, list, count, least / 2 + 1, 150);
}

enum tw_status dual_improve(struct dual *dual, struct search *search, uint64_t effort, uint64_t target)
{
	const struct instance *instance = dual->instance;
	static const unsigned factors[] = {150, 300, 1000, 0};
	uint64_t end = search->work + effort;
	uint32_t k = instance->terminal_count;
	while (search->work < end && dual_fine_bound(dual) < target) {
		uint32_t centre = (uint32_t)draw(dual, k), group[16], count = 0;
		uint32_t size = 2 + (uint32_t)draw(dual, 6);
		if (centre != dual->root)
			group[count++] = centre;
		for (uint32_t i = 0; i < dual->near_count && count < size; i++)
			if (dual->near[centre * dual->near_count + i] != dual->root)
				group[count++] = dual->near[centre * dual->near_count + i];
		uint64_t before = dual->bound, least = UINT32_MAX;
		if (!has_room(dual))
			return TW_ERROR_MEMORY;
		uint32_t old_balls = dual->ball_count;
		for (uint32_t i = 0; i < count; i++)
			if (dual->near_distance[group[i]] < least)
				least = dual->near_distance[group[i]];
		for (uint32_t b = 0; b < old_balls; b++)
			for (uint32_t i = 0; i < count; i++)
				if (dual->ball[b].terminal == group[i])
					take_out(dual, search, &dual->ball[b]);
		shuffle(dual, group, count);
		uint32_t copy[16];
		memcpy(copy, group, sizeof copy);
		enum tw_status status = ascend(dual, search, copy, count, least / 2 + 1, factors[draw(dual, 4)]);
		/* make_room may have renumbered the balls, but keeps their order: those taken out come first. */
		int worse = dual->bound < before;
		for (uint32_t b = 0; b < dual->ball_count && worse; b++)
			if (dual->ball[b].applied)
				for (uint32_t i = 0; i < count; i++)
					if (dual->ball[b].terminal == group[i]) {
						take_out(dual, search, &dual->ball[b]);
						dual->ball[b].terminal = INSTANCE_NONE;
						break;
					}
		for (uint32_t b = 0; b < dual->ball_count; b++)
			if (!dual->ball[b].applied && dual->ball[b].terminal != INSTANCE_NONE) {
				if (worse)
					put_back(dual, search, &dual->ball[b]);
				else
					dual->ball[b].terminal = INSTANCE_NONE;
			}
		if (status != TW_OK)
			return status;
		if (!search_spend(search, 0))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

/* --- to a smaller instance ---------------------------------------------------------------------------------------- */

enum tw_status dual_transfer(struct dual *dual, struct search *search, const struct dual *from, const uint32_t *number)
{
	*dual = (struct dual){.root = from->root, .random = from->random, .coarse_shift = from->coarse_shift};
	enum tw_status status = allocate(dual, search, from->member_count);
	if (status != TW_OK)
		return status;
	size_t k = search->instance.terminal_count;
	memcpy(dual->near, from->near, k * dual->near_count * sizeof *dual->near);
	memcpy(dual->near_distance, from->near_distance, k * sizeof *dual->near_distance);
	for (uint32_t b = 0; b < from->ball_count; b++) {
		const struct dual_member *member = from->member + from->ball[b].start;
		struct dual_ball ball = from->ball[b];
		if (!ball.applied)
			continue;
		ball.start = dual->member_count;
		ball.count = 0;
		for (uint32_t i = 0; i < from->ball[b].count; i++) {
			uint32_t v = number[member[i].vertex];
			if (v != INSTANCE_NONE)
				dual->member[ball.start + ball.count++] = (struct dual_member){v, member[i].distance};
		}
		dual->member_count += ball.count;
		if (dual->ball_count == dual->ball_capacity && !make_room(dual))
			return TW_ERROR_MEMORY;
		dual->ball[dual->ball_count++] = ball;
		put_back(dual, search, &dual->ball[dual->ball_count - 1]);
	}
	return TW_OK;
}
