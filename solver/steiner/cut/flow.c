/* Purpose: maximum flows by E. A. Dinic (Algorithm for solution of a problem of maximum flow in networks with power
 * estimation, Soviet Math. Dokl. 11, 1970), in integers, so that the cuts are the same everywhere.
 *
 * A solution is violated for a target exactly if the flow from the root to it with the capacities x is below 1. From
 * one flow come two minimum cuts, the one near the target and the one near the root; then the cut's arcs are given
 * capacity 1 and the flow goes on (nested cuts; T. Koch & A. Martin, Solving Steiner tree problems in graphs to
 * optimality, Networks 32, 1998). A unit of capacity on every allowed arc (creep flow, ibid.) makes the cuts have few
 * arcs. */
#include "solver/steiner/cut/flow.h"

#include "solver/steiner/stamp.h"

#include <assert.h>
#include <string.h>

enum { ONE = 1 << 24, VIOLATED_BELOW = ONE - ONE / 2000, NESTED_MAX = 2, CREEP_ARCS_MAX = 60000 };

struct flow {
	const struct cut_problem *problem;
	int32_t *capacity; /* [arc_count] left */
	int32_t *start;    /* [arc_count] capacity at the beginning */
	uint32_t *level;   /* [vertex_count] valid where mark is */
	uint32_t *marked;  /* [vertex_count] */
	uint32_t mark;
	uint32_t *next;  /* [vertex_count] row entry to go on from */
	uint32_t *queue; /* [vertex_count] */
	uint32_t *path;  /* [vertex_count] arcs */
};

/* Levels from the root by arcs with capacity. True when the target has one. */
static int find_levels(struct flow *flow, uint32_t target)
{
	const struct instance *instance = flow->problem->instance;
	uint32_t count = 0;
	flow->mark = stamp_next(flow->mark, flow->marked, instance->vertex_count);
	flow->marked[flow->problem->root] = flow->mark;
	flow->level[flow->problem->root] = 0;
	flow->queue[count++] = flow->problem->root;
	for (uint32_t i = 0; i < count && flow->marked[target] != flow->mark; i++) {
		const uint32_t v = flow->queue[i];
		flow->next[v] = instance->first[v];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a];
			if (flow->marked[u] == flow->mark || flow->capacity[cut_arc_out(flow->problem, v, a)] <= 0)
				continue;
			flow->marked[u] = flow->mark;
			flow->level[u] = flow->level[v] + 1;
			flow->next[u] = instance->first[u];
			flow->queue[count++] = u;
		}
		flow->problem->search->work += instance->first[v + 1] - instance->first[v];
	}
	return flow->marked[target] == flow->mark;
}

static int32_t push_path(struct flow *flow, uint32_t length)
{
	int32_t amount = INT32_MAX;
	for (uint32_t i = 0; i < length; i++)
		if (flow->capacity[flow->path[i]] < amount)
			amount = flow->capacity[flow->path[i]];
	for (uint32_t i = 0; i < length; i++) {
		flow->capacity[flow->path[i]] -= amount;
		flow->capacity[flow->path[i] ^ 1] += amount;
	}
	return amount;
}

/* A blocking flow on the levels, until `wanted` units have arrived. */
static int32_t block(struct flow *flow, uint32_t target, int32_t wanted)
{
	const struct instance *instance = flow->problem->instance;
	uint32_t v = flow->problem->root, length = 0;
	int32_t sum = 0;
	while (sum < wanted) {
		if (v == target) {
			sum += push_path(flow, length);
			v = flow->problem->root;
			length = 0;
			continue;
		}
		uint32_t *a = &flow->next[v];
		for (; *a < instance->first[v + 1]; (*a)++) {
			const uint32_t u = instance->head[*a];
			if (flow->marked[u] == flow->mark && flow->level[u] == flow->level[v] + 1 &&
			    flow->capacity[cut_arc_out(flow->problem, v, *a)] > 0)
				break;
		}
		if (*a < instance->first[v + 1]) {
			flow->path[length++] = cut_arc_out(flow->problem, v, *a);
			v = instance->head[*a];
		} else if (length) {
			v = cut_tail(flow->problem, flow->path[--length]);
			flow->next[v]++;
		} else {
			break;
		}
	}
	return sum;
}

/* Raises the flow to the target; true when it reaches VIOLATED_BELOW. *sum is kept between calls. */
static int is_satisfied(struct flow *flow, uint32_t target, int32_t *sum)
{
	while (*sum < VIOLATED_BELOW) {
		if (!find_levels(flow, target))
			return 0;
		*sum += block(flow, target, ONE - *sum);
	}
	return 1;
}

/* The vertices that still reach the target, into `queue`. */
static uint32_t collect_target_side(struct flow *flow, uint32_t target)
{
	const struct instance *instance = flow->problem->instance;
	uint32_t count = 0;
	flow->mark = stamp_next(flow->mark, flow->marked, instance->vertex_count);
	flow->marked[target] = flow->mark;
	flow->queue[count++] = target;
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t v = flow->queue[i];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a];
			if (flow->marked[u] == flow->mark || flow->capacity[cut_arc_out(flow->problem, v, a) ^ 1] <= 0)
				continue;
			flow->marked[u] = flow->mark;
			flow->queue[count++] = u;
		}
	}
	return count;
}

/* Everything that the root does not reach, into `queue`. find_levels has just failed. */
static uint32_t collect_far_side(struct flow *flow)
{
	const uint32_t n = flow->problem->instance->vertex_count, near = flow->mark;
	uint32_t count = 0;
	assert(near <= STAMP_LAST);
	flow->mark++; /* without a wipe: the marks of find_levels are still needed */
	for (uint32_t v = 0; v < n; v++)
		if (flow->marked[v] != near) {
			flow->marked[v] = flow->mark;
			flow->queue[count++] = v;
		}
	return count;
}

/* Gives full capacity to the arcs of the rows from `row` on. */
static void open_cuts(struct flow *flow, const struct cut_pool *pool, uint32_t row)
{
	for (size_t i = pool->start[row]; i < pool->start[pool->count]; i++) {
		const uint32_t arc = pool->arc[i]; /* of a cut: none is negative */
		flow->capacity[arc] += ONE - flow->start[arc];
		flow->start[arc] = ONE;
	}
}

/* Adds the cuts of one target. False when the pool is full. */
static int cut_target(struct flow *flow, uint32_t target, const double *x, int32_t creep, struct cut_pool *pool)
{
	const struct cut_problem *problem = flow->problem;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		flow->start[arc] = problem->allowed[arc] ? (int32_t)(x[arc] * ONE + 0.5) + creep : 0;
	memcpy(flow->capacity, flow->start, problem->arc_count * sizeof *flow->capacity);
	int32_t sum = 0;
	for (uint32_t nested = 0; nested < NESTED_MAX && !is_satisfied(flow, target, &sum); nested++) {
		const uint32_t row = pool->count, far_count = collect_far_side(flow);
		if (!cut_pool_add(pool, problem, target, flow->queue, far_count, flow->marked, flow->mark))
			return 0;
		/* Both cuts belong to the same flow: capacities change only afterwards. */
		const uint32_t count = collect_target_side(flow, target);
		if (count < far_count)
			(void)cut_pool_add(pool, problem, target, flow->queue, count, flow->marked, flow->mark);
		open_cuts(flow, pool, row);
	}
	return 1;
}

enum tw_status cut_separate(const struct cut_problem *problem, const double *x, struct cut_pool *pool, int *full)
{
	struct arena *arena = problem->search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const size_t n = problem->instance->vertex_count;
	struct flow flow = {
		.problem = problem,
		.capacity = ARENA_ARRAY(arena, problem->arc_count, int32_t),
		.start = ARENA_ARRAY(arena, problem->arc_count, int32_t),
		.level = ARENA_ARRAY(arena, n, uint32_t),
		.marked = ARENA_ZEROED(arena, n, uint32_t),
		.mark = STAMP_FIRST,
		.next = ARENA_ARRAY(arena, n, uint32_t),
		.queue = ARENA_ARRAY(arena, n, uint32_t),
		.path = ARENA_ARRAY(arena, n, uint32_t),
	};
	enum tw_status status =
		flow.capacity && flow.start && flow.level && flow.marked && flow.next && flow.queue && flow.path
			? TW_OK
			: TW_ERROR_MEMORY;
	*full = 0;
	for (uint32_t t = 0; t < problem->target_count && status == TW_OK && !*full; t++) {
		const int32_t creep = problem->arc_count <= CREEP_ARCS_MAX;
		*full = !cut_target(&flow, problem->target[t], x, creep, pool);
		if (!search_spend(problem->search, problem->arc_count / 4))
			status = TW_ERROR_CANCELLED;
	}
	arena_release(arena, mark);
	return status;
}
