/* Purpose: let a good tree tell the dual where to grow.
 *
 * Complementary slackness: for a tree T directed away from the root, weight(T) - bound is the sum of two losses, the
 * costs that are left on the arcs of T, and, for every cut, its value times the number of arcs beyond the first by
 * which T enters it. An ascent that knows a light tree can avoid the second: a ball stops growing as soon as it cuts
 * the tree in two parts, and waits until the balls of other terminals have made the way between the parts free. And a
 * local search that knows both sees at which terminals the bound is lost. Any tree will do for a sound bound, because
 * it only chooses the order of growth. */
#include "solver/steiner/dual/guide.h"

#include "solver/steiner/dual/ball.h"

#include <string.h>

enum tw_status dual_guide_allocate(struct dual *dual, struct search *search)
{
	const size_t n = search->instance.vertex_count;
	dual->guide_first = ARENA_ZEROED(search->arena, n + 1, uint32_t);
	dual->guide_next = ARENA_ARRAY(search->arena, 2 * n, uint32_t);
	dual->guide_parent = ARENA_ARRAY(search->arena, n, uint32_t);
	dual->guide_vertex = ARENA_ARRAY(search->arena, n, uint32_t);
	dual->inside = ARENA_ZEROED(search->arena, n, uint8_t);
	dual->fault_capacity = (uint32_t)(n + 16 * (size_t)search->instance.terminal_count);
	dual->fault = ARENA_ARRAY(search->arena, dual->fault_capacity, struct dual_fault);
	return dual->guide_first && dual->guide_next && dual->guide_parent && dual->guide_vertex && dual->inside &&
			       dual->fault
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

static void forget_guide(struct dual *dual)
{
	dual->guide_count = 0;
	memset(dual->guide_first, 0, ((size_t)dual->instance->vertex_count + 1) * sizeof *dual->guide_first);
}

/* The rows of the tree's vertices, which are empty elsewhere. */
static void fill_rows(struct dual *dual, const uint8_t *is_best)
{
	const struct instance *instance = dual->instance;
	uint32_t count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		dual->guide_first[v] = count;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++)
			if (is_best[instance->edge[a]])
				dual->guide_next[count++] = instance->head[a];
	}
	dual->guide_first[instance->vertex_count] = count;
}

/* Lists the tree's vertices from the root on, each after its parent. False when the edges are no tree that spans the
 * terminals: deletion may have taken some of them, and reductions may have laid others together. */
static int hang_from_root(struct dual *dual, uint32_t edge_count)
{
	const struct instance *instance = dual->instance;
	const uint32_t root = instance->terminal[dual->root];
	uint32_t terminals = 0;
	memset(dual->guide_parent, 0xff, instance->vertex_count * sizeof *dual->guide_parent);
	dual->guide_vertex[0] = root;
	dual->guide_count = 1;
	for (uint32_t i = 0; i < dual->guide_count; i++) {
		const uint32_t v = dual->guide_vertex[i];
		terminals += instance->terminal_at[v] != INSTANCE_NONE;
		for (uint32_t j = dual->guide_first[v]; j < dual->guide_first[v + 1]; j++) {
			const uint32_t u = dual->guide_next[j];
			if (u == root || dual->guide_parent[u] != INSTANCE_NONE)
				continue;
			dual->guide_parent[u] = v;
			dual->guide_vertex[dual->guide_count++] = u;
		}
	}
	return terminals == instance->terminal_count && dual->guide_count == edge_count + 1;
}

enum tw_status dual_guide(struct dual *dual, struct search *search)
{
	const struct instance *instance = dual->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	forget_guide(dual);
	if (!search_uses(search, STEINER_GUIDE))
		return TW_OK;
	uint8_t *is_best = ARENA_ARRAY(search->arena, instance->edge_count, uint8_t);
	enum tw_status status = is_best ? search_mark_best(search, is_best) : TW_ERROR_MEMORY;
	uint32_t edges = 0;
	for (uint32_t e = 0; status == TW_OK && e < instance->edge_count; e++)
		edges += is_best[e];
	if (status == TW_OK && edges && edges < instance->vertex_count) {
		fill_rows(dual, is_best);
		if (!hang_from_root(dual, edges))
			forget_guide(dual);
	}
	arena_release(search->arena, mark);
	search->work += instance->edge_count / 4;
	return status;
}

static void add_fault(struct dual *dual, uint64_t loss, uint32_t terminal, uint64_t level)
{
	if (!loss || terminal == INSTANCE_NONE || dual->fault_count == dual->fault_capacity)
		return;
	dual->fault[dual->fault_count++] = (struct dual_fault){loss, level, terminal};
	dual->fault_sum += loss;
}

/* The length of the guide inside the ball beyond its radius. */
static uint64_t excess_of(const struct dual *dual, const struct dual_ball *ball)
{
	const struct dual_member *member = dual->member + ball->start;
	const uint32_t *parent = dual->guide_parent;
	uint32_t *distance = dual->distance;
	uint64_t length = 0;
	for (uint32_t i = 0; i < ball->count; i++)
		distance[member[i].vertex] = member[i].distance;
	for (uint32_t i = 0; i < ball->count; i++) {
		const uint32_t v = member[i].vertex, d = member[i].distance;
		if (parent[v] == INSTANCE_NONE)
			continue;
		const uint32_t outer = distance[parent[v]] < ball->radius ? distance[parent[v]] : ball->radius;
		length += outer > d ? outer - d : 0;
	}
	for (uint32_t i = 0; i < ball->count; i++)
		distance[member[i].vertex] = UINT32_MAX;
	return length > ball->radius ? length - ball->radius : 0;
}

/* A terminal at or below the vertex in the guide; INSTANCE_NONE at a bare end, which reductions may leave. */
static uint32_t terminal_below(struct dual *dual, uint32_t v)
{
	const struct instance *instance = dual->instance;
	while (instance->terminal_at[v] == INSTANCE_NONE) {
		const uint32_t first = dual->guide_first[v], degree = dual->guide_first[v + 1] - first;
		if (degree < 2)
			return INSTANCE_NONE;
		uint32_t child = dual->guide_next[first + (uint32_t)dual_draw(dual, degree)];
		if (child == dual->guide_parent[v]) /* the next in the row is none */
			child = dual->guide_next[first + (child == dual->guide_next[first])];
		v = child;
	}
	return instance->terminal_at[v];
}

void dual_find_faults(struct dual *dual, struct search *search)
{
	const struct instance *instance = dual->instance;
	uint64_t *inner = dual->inner, work = 0;
	dual->fault_count = 0;
	dual->fault_sum = 0;
	memset(inner, 0, instance->terminal_count * sizeof *inner);
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		if (!ball->applied || ball->terminal == INSTANCE_NONE)
			continue;
		add_fault(dual, excess_of(dual, ball), ball->terminal, inner[ball->terminal]);
		inner[ball->terminal] += ball->radius;
		work += ball->count;
	}
	for (uint32_t i = 1; i < dual->guide_count; i++) {
		const uint32_t v = dual->guide_vertex[i];
		uint32_t a = instance->first[v];
		while (instance->head[a] != dual->guide_parent[v])
			a++;
		if (dual->arc[a].cost)
			add_fault(dual, dual->arc[a].cost, terminal_below(dual, v), UINT64_MAX);
	}
	search->work += work + dual->guide_count;
}
