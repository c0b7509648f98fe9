/* Purpose: make the instance smaller before anything expensive looks at it.
 *
 * A round judges edges and vertices by distances (distance.c), carries the verdicts out, and then applies the
 * simple tests until none fires (collected by C. W. Duin & A. Volgenant, Networks 19, 1989):
 * - a vertex that is no terminal and has one edge is not in an optimum; with two edges it is a bend: they become one;
 *   a passed vertex becomes an edge for each pair of its edges;
 * - a terminal with one edge needs it; so it does its lightest edge if that leads to a terminal. Needed edges are
 * contracted. Each of the simple tests holds for some optimum of what is left, and they are applied one after the
 * other. Origins (instance.h) lead every edge back to the caller's. */
#include "solver/steiner/reduce/reduce.h"

#include "solver/steiner/reduce/distance.h"
#include "solver/steiner/reduce/graph.h"

enum { ROUNDS_MAX = 12, GAIN_PERCENT = 2, PASSED_DEGREE_MAX = 4 };

/* Replaces the edges at v, where every optimum has two of them or none, by edges around it. */
static void bridge(struct reduce_graph *graph, struct instance *instance, uint32_t v)
{
	uint32_t to[PASSED_DEGREE_MAX], origin[PASSED_DEGREE_MAX], count = 0;
	fine_t weight[PASSED_DEGREE_MAX];
	const uint32_t degree = graph->degree[v], pairs = degree * (degree - 1) / 2;
	if (instance->pair_count + pairs > instance->pair_capacity || graph->free_count + degree < pairs)
		return;
	while (graph->first[v] != INSTANCE_NONE) {
		const uint32_t side = graph->first[v];
		to[count] = reduce_graph_other(graph, side);
		weight[count] = graph->weight[side / 2];
		origin[count++] = graph->origin[side / 2];
		reduce_graph_delete(graph, side / 2);
	}
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t j = 0; j < i; j++)
			reduce_graph_add(graph, to[i], to[j], weight[i] + weight[j],
					 instance_join(instance, origin[i], origin[j]));
}

/* Contracts the edge that a terminal surely needs. Returns whether there was one. */
static int take_at(struct reduce_graph *graph, struct instance *instance, uint32_t v)
{
	uint32_t lightest = graph->first[v];
	for (uint32_t side = lightest; side != INSTANCE_NONE; side = graph->next[side]) {
		const fine_t weight = graph->weight[side / 2], best = graph->weight[lightest / 2];
		const int to_terminal = graph->is_terminal[reduce_graph_other(graph, side)];
		if (weight < best || (weight == best && to_terminal))
			lightest = side;
	}
	if (lightest == INSTANCE_NONE ||
	    (graph->degree[v] > 1 && !graph->is_terminal[reduce_graph_other(graph, lightest)]))
		return 0;
	reduce_graph_take(graph, instance, lightest / 2);
	return 1;
}

static void apply_simple_tests(struct search *search, struct reduce_graph *graph, const uint8_t *is_passed)
{
	struct instance *instance = &search->instance;
	for (uint32_t v; (v = reduce_graph_pop(graph)) != INSTANCE_NONE && graph->terminal_count > 1;) {
		search->work += 1 + graph->degree[v];
		if (graph->is_terminal[v]) {
			take_at(graph, instance, v);
		} else if (graph->degree[v] == 1) {
			reduce_graph_delete(graph, graph->first[v] / 2);
		} else if (graph->degree[v] == 2 ||
			   (is_passed[v] && graph->degree[v] && graph->degree[v] <= PASSED_DEGREE_MAX)) {
			bridge(graph, instance, v);
		}
	}
}

/* What a stage must put back when it cannot finish: the edges themselves are replaced last. */
struct history {
	uint32_t pair_count, taken_count;
	fine_t base;
};

static enum tw_status run_round(struct search *search)
{
	struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const struct history before = {instance->pair_count, instance->taken_count, instance->base};
	struct reduce_graph graph;
	struct reduce_verdict verdict = {
		.is_useless = ARENA_ARRAY(arena, instance->edge_count, uint8_t),
		.is_needed = ARENA_ARRAY(arena, instance->edge_count, uint8_t),
		.is_passed = ARENA_ARRAY(arena, instance->vertex_count, uint8_t),
	};
	enum tw_status status = verdict.is_useless && verdict.is_needed && verdict.is_passed ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK)
		status = reduce_distance_judge(search, &verdict);
	if (status == TW_OK)
		status = reduce_graph_init(&graph, arena, instance);
	if (status == TW_OK) {
		for (uint32_t e = 0; e < instance->edge_count; e++)
			if (verdict.is_useless[e])
				reduce_graph_delete(&graph, e);
		/* No other edge is added or merged yet, so the slots are still the instance's edges; but a needed one
		 * may have become parallel to a lighter needed one. */
		for (uint32_t e = 0; e < instance->edge_count; e++)
			if (verdict.is_needed[e] && graph.end[2 * e] != INSTANCE_NONE)
				reduce_graph_take(&graph, instance, e);
		apply_simple_tests(search, &graph, verdict.is_passed);
		status = reduce_graph_store(&graph, instance, arena);
	}
	if (status != TW_OK) {
		instance->pair_count = before.pair_count;
		instance->taken_count = before.taken_count;
		instance->base = before.base;
	}
	arena_release(arena, mark);
	return status;
}

static int has_parallel_edges(const struct instance *instance, uint32_t *last)
{
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		last[v] = INSTANCE_NONE;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			if (last[instance->head[a]] == v)
				return 1;
			last[instance->head[a]] = v;
		}
	return 0;
}

/* The lightest of parallel edges stays (instance_replace); the tests rely on it. */
static enum tw_status drop_parallel_edges(struct search *search)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const struct instance *instance = &search->instance;
	uint32_t *last = ARENA_ARRAY(search->arena, instance->vertex_count, uint32_t);
	enum tw_status status = last ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK && has_parallel_edges(instance, last)) {
		struct reduce_graph graph;
		status = reduce_graph_init(&graph, search->arena, instance);
		if (status == TW_OK)
			status = reduce_graph_store(&graph, &search->instance, search->arena);
	}
	arena_release(search->arena, mark);
	return status;
}

enum tw_status reduce_instance(struct search *search)
{
	if (!search_uses(search, STEINER_REDUCTIONS) || search->instance.terminal_count < 2)
		return TW_OK;
	enum tw_status status = drop_parallel_edges(search);
	if (status == TW_OK && !reduce_distance_pays(search))
		return TW_OK;
	for (uint32_t round = 0; round < ROUNDS_MAX && status == TW_OK && search->instance.terminal_count > 1;
	     round++) {
		const uint64_t before = search->instance.edge_count;
		status = run_round(search);
		if ((before - search->instance.edge_count) * 100 < GAIN_PERCENT * before)
			break;
	}
	return status;
}
