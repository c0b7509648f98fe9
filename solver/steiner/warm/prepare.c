/* Purpose: prepare a warm state.
 *
 * A search deletes most of the graph before its bounds get good, and what it deleted may lie where the next terminal
 * does. So the state is a dual of the whole graph, by a flow with enough iterations (flow.h), whose balls are summed to
 * one potential for each terminal. */
#include "solver/steiner/flow/flow.h"
#include "solver/steiner/warm/memory.h"
#include "solver/steiner/warm/state.h"

#include <string.h>

/* With 36 terminals on 23,500 vertices 60 iterations leave 0.02 to 0.06 per cent, elsewhere they leave 0.2; beyond 180
 * little is gained. */
enum { ITERATIONS = 60, PARTS = 3, SMALL_LOSS_PER_MILLION = 500, ASCENT_SHARE = 8 };

static bool has_small_loss(const struct search *search, const struct dual *dual)
{
	const fine_t loss = search->best_fine - dual_fine_bound(dual);
	return loss <= search->best_fine / 1000000 * SMALL_LOSS_PER_MILLION;
}

/* The flow's balls on the whole instance. */
static enum tw_status find_dual(struct search *search, struct dual *dual, struct flow **flow)
{
	enum tw_status status = dual_ascend_best(dual, search, ASCENT_SHARE * (uint64_t)search->instance.edge_count);
	if (status == TW_OK)
		status = flow_new(flow, search, dual);
	for (uint32_t part = 0; status == TW_OK && part < PARTS && !has_small_loss(search, dual); part++) {
		status = flow_iterate(*flow, search, ITERATIONS);
		if (status == TW_OK)
			status = flow_raise_dual(*flow, search, dual, NULL);
	}
	return status;
}

static uint32_t stride_of(const struct search *search)
{
	const uint32_t lanes = search->instance.terminal_count - 1;
	return (lanes + WARM_LANES - 1) / WARM_LANES * WARM_LANES;
}

/* Whether the potentials, which are nearly all of a state without its flow, may be had: else nothing is worth a start.
 */
static bool fits(const struct steiner_warm *warm, const struct search *search)
{
	const size_t most = warm->budget / sizeof *warm->potential / stride_of(search);
	return !warm->budget || search->graph->vertex_count <= most;
}

static bool allocate(struct steiner_warm *warm, const struct search *search)
{
	const size_t rows = search->graph->vertex_count, lanes = search->instance.terminal_count - 1;
	warm->lasting_count = warm_lasting(search);
	warm->extra_count = search->graph->vertex_count - warm->lasting_count;
	warm->lane_count = (uint32_t)lanes;
	warm->stride = stride_of(search);
	warm->arena = arena_new(warm->budget);
	if (!warm->arena)
		return false;
	warm->extra_key = ARENA_ARRAY(warm->arena, warm->extra_count, warm_key);
	warm->lane = ARENA_ARRAY(warm->arena, lanes, warm_key);
	warm->potential = ARENA_ARRAY(warm->arena, rows * warm->stride, int32_t);
	return warm->extra_key && warm->lane && warm->potential;
}

static uint32_t lane_of(const struct dual *dual, uint32_t terminal)
{
	return terminal - (terminal > dual->root);
}

/* All vertices begin outside of all balls; unknown ones stay marked. */
static void fill(struct steiner_warm *warm, const struct search *search, const struct dual *dual,
		 const uint32_t *vertex_of)
{
	const struct instance *instance = &search->instance;
	const size_t stride = warm->stride;
	for (uint32_t r = 0; r < search->graph->vertex_count; r++)
		warm->potential[r * stride] = WARM_UNKNOWN;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		int32_t *row = warm->potential + vertex_of[v] * stride;
		memset(row, 0, stride * sizeof *row);
		for (uint32_t t = 0; t < instance->terminal_count; t++)
			if (t != dual->root)
				row[lane_of(dual, t)] = (int32_t)dual->value[t];
	}
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		const struct dual_member *member = dual->member + ball->start;
		const uint32_t lane = ball->applied ? lane_of(dual, ball->terminal) : 0;
		for (uint32_t i = 0; ball->applied && i < ball->count; i++) {
			const size_t row = vertex_of[member[i].vertex];
			warm->potential[row * stride + lane] -= (int32_t)(ball->radius - member[i].distance);
		}
	}
}

static enum tw_status store(struct steiner_warm *warm, struct search *search, const struct dual *dual,
			    const struct flow *flow)
{
	const struct instance *instance = &search->instance;
	uint32_t *vertex_of = ARENA_ARRAY(search->arena, instance->vertex_count, uint32_t);
	struct steiner_warm new = {.budget = warm->budget, .coarse_shift = dual->coarse_shift};
	if (!vertex_of || !allocate(&new, search)) {
		arena_free(new.arena);
		return TW_ERROR_MEMORY;
	}
	warm_name_vertices(search, vertex_of);
	for (uint32_t i = 0; i < new.extra_count; i++)
		new.extra_key[i] = warm_key_of(search, new.lasting_count + i);
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		const warm_key key = warm_key_of(search, vertex_of[instance->terminal[t]]);
		if (t == dual->root)
			new.root = key;
		else
			new.lane[lane_of(dual, t)] = key;
	}
	fill(&new, search, dual, vertex_of);
	new.loss = search->best_fine - dual_fine_bound(dual);
	warm_memory_keep(&new, search, flow, vertex_of);
	arena_free(warm->arena);
	*warm = new;
	return TW_OK;
}

static enum tw_status prepare(struct steiner_warm *warm, struct search *search, const struct steiner_tree *tree)
{
	uint32_t apart[2];
	struct dual dual;
	struct flow *flow = NULL;
	search->best_edges = ARENA_ARRAY(search->arena, search->graph->vertex_count, uint32_t);
	enum tw_status status = search->best_edges ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK)
		status = instance_init(&search->instance, search->arena, search->graph, search->terminals,
				       search->terminal_count, search->options->ties, true, apart);
	if (status == TW_OK && search->instance.terminal_count < 2)
		return TW_OK;
	if (status == TW_OK && !fits(warm, search))
		status = TW_ERROR_MEMORY;
	if (status == TW_OK)
		status = search_offer_leaves(search, tree->edges, tree->edge_count);
	if (status == TW_OK)
		status = find_dual(search, &dual, &flow);
	return status == TW_OK ? store(warm, search, &dual, flow) : status;
}

enum tw_status steiner_warm_prepare(struct steiner_warm *warm, const struct graph *graph, const uint32_t *terminals,
				    uint32_t terminal_count, const struct steiner_options *options,
				    const struct steiner_tree *tree)
{
	struct steiner_options own = *options;
	struct steiner_stats stats = {0};
	own.time_limit_s = 0;
	own.work_limit = 0;
	own.progress = NULL;
	struct search search;
	warm->is_due = false;
	search_init(&search, graph, terminals, terminal_count, &own, &stats, NULL);
	search.arena = arena_new(own.memory_limit);
	const enum tw_status status = search.arena ? prepare(warm, &search, tree) : TW_ERROR_MEMORY;
	arena_free(search.arena);
	return status;
}
