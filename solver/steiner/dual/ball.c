/* Purpose: balls: growing them, taking them out, putting them back.
 *
 * Data: every arc stands in the row of the vertex that it enters, with its reduced cost beside it, so that the
 * backward Dijkstra from a terminal reads one row for each vertex it settles. Nothing here costs more than the balls
 * that are touched. Vertices at the very current distance, and reduced graphs are full of arcs that cost nothing, go to
 * a stack instead of the queue.
 *
 * Sound: for s below the radius, which is at most the root's distance, the set {D <= s} holds the terminal and not the
 * root, so it is a cut. An arc u -> v enters it for D[v] <= s < D[u], a length of at most its cost, as D[u] <= D[v] +
 * cost. */
#include "solver/steiner/dual/ball.h"

#include <assert.h>
#include <string.h>

static void scatter(const struct dual *dual, const struct dual_ball *ball)
{
	const struct dual_member *member = dual->member + ball->start;
	for (uint32_t i = 0; i < ball->count; i++) {
		assert(dual->distance[member[i].vertex] == UINT32_MAX);
		dual->distance[member[i].vertex] = member[i].distance;
	}
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
			assert(sign || arc[a].cost >= share);
			arc[a].cost -= (share ^ sign) - sign;
		}
	}
}

void dual_take_out(struct dual *dual, struct search *search, struct dual_ball *ball)
{
	assert(ball->applied);
	scatter(dual, ball);
	shift_costs(dual, ball, UINT32_MAX);
	gather(dual, ball);
	ball->applied = false;
	dual->value[ball->terminal] -= ball->radius;
	dual->bound -= ball->radius;
	search->work += 2 * (uint64_t)ball->count;
}

void dual_put_back(struct dual *dual, struct search *search, struct dual_ball *ball)
{
	assert(!ball->applied && ball->terminal != INSTANCE_NONE);
	scatter(dual, ball);
	shift_costs(dual, ball, 0);
	gather(dual, ball);
	ball->applied = true;
	dual->value[ball->terminal] += ball->radius;
	dual->bound += ball->radius;
	search->work += 2 * (uint64_t)ball->count;
}

/* Slides the live balls together; returns false when even so there is no room for one more, and no memory for it. */
static int slide(struct dual *dual)
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

int dual_make_room(struct dual *dual)
{
	return (dual->ball_count < dual->ball_capacity &&
		dual->member_count + dual->instance->vertex_count <= dual->member_capacity) ||
	       slide(dual);
}

/* What settling leaves behind: vertices that were reached, but not settled, in queue and stack. */
struct dual_front {
	uint32_t settled; /* at the free end of dual->member */
	uint32_t radius;
	size_t stacked;
	enum dual_stop stop;
};

/* The distances around the terminal up to the root, `limit`, or what the guide allows. A ball's vertices at one
 * distance are settled before the guide is asked, because they come in together. */
static inline struct dual_front settle(struct dual *dual, uint32_t terminal, uint32_t limit, int guided)
{
	const struct instance *instance = dual->instance;
	const uint32_t *first = instance->first;
	const struct dual_arc *arc = dual->arc;
	struct dual_member *member = dual->member + dual->member_count;
	uint32_t *distance = dual->distance, *stack = dual->stack;
	struct dual_queue *queue = dual->queue;
	const uint32_t root = instance->terminal[dual->root];
	uint32_t count = 0, d = 0;
	int32_t parts = 0;
	size_t stacked = 0;
	enum dual_stop stop = DUAL_AT_LIMIT;
	assert(distance[instance->terminal[terminal]] == UINT32_MAX);
	distance[instance->terminal[terminal]] = 0;
	stack[stacked++] = instance->terminal[terminal];
	for (;;) {
		uint32_t v;
		uint64_t key;
		if (stacked) {
			v = stack[--stacked];
		} else if (guided && parts > 1) {
			stop = DUAL_AT_GUIDE;
			break;
		} else if (queue_pop(queue, distance, &key)) {
			v = (uint32_t)key;
			d = distance[v];
		} else {
			d = limit;
			break;
		}
		member[count++] = (struct dual_member){v, d};
		if (v == root) {
			stop = DUAL_AT_ROOT;
			break;
		}
		if (guided) {
			assert(!dual->inside[v]);
			dual->inside[v] = 1;
			parts += dual_guide_parts(&dual->guide, dual->inside, v);
		}
		for (uint32_t a = first[v], end = first[v + 1]; a < end; a++) {
			uint32_t u = arc[a].tail, longer = d + arc[a].cost;
			if (longer >= distance[u] || longer >= limit)
				continue;
			distance[u] = longer;
			if (u == root)
				limit = longer + 1;
			assert(stacked < 2 * (size_t)instance->edge_count + instance->terminal_count);
			if (longer == d)
				stack[stacked++] = u;
			else
				queue_push(queue, (uint64_t)longer << 32 | u);
		}
	}
	return (struct dual_front){.settled = count, .radius = d, .stacked = stacked, .stop = stop};
}

static void wipe(struct dual *dual, const struct dual_front *front, int guided)
{
	const struct dual_member *member = dual->member + dual->member_count;
	for (uint32_t i = 0; i < front->settled; i++)
		dual->distance[member[i].vertex] = UINT32_MAX;
	for (uint32_t i = 0; guided && i < front->settled; i++)
		dual->inside[member[i].vertex] = 0;
	queue_wipe(dual->queue, dual->distance);
	for (size_t i = 0; i < front->stacked; i++)
		dual->distance[dual->stack[i]] = UINT32_MAX;
}

enum dual_stop dual_grow(struct dual *dual, struct search *search, uint32_t terminal, uint32_t limit, int guided)
{
	assert(dual->ball_count < dual->ball_capacity &&
	       dual->member_count + dual->instance->vertex_count <= dual->member_capacity && terminal != dual->root);
	const uint32_t most = limit < DUAL_FAR ? limit : DUAL_FAR;
	const struct dual_front front = guided ? settle(dual, terminal, most, 1) : settle(dual, terminal, most, 0);
	const struct dual_member *member = dual->member + dual->member_count;
	struct dual_ball ball = {
		.terminal = terminal,
		.radius = front.radius,
		.start = dual->member_count,
		.count = front.settled,
		.is_new = true,
		.applied = true,
	};
	while (ball.count && member[ball.count - 1].distance >= ball.radius)
		ball.count--;
	if (ball.radius)
		shift_costs(dual, &ball, 0);
	wipe(dual, &front, guided);
	search->work += 4 * (uint64_t)front.settled + 4;
	if (ball.radius) {
		dual->ball[dual->ball_count++] = ball;
		dual->member_count += ball.count;
		dual->value[terminal] += ball.radius;
		dual->bound += ball.radius;
	}
	return front.stop;
}
