/* For the tests of duals: a search with a first tree on a small mesh, and the check of what balls claim. */
#ifndef TESTS_UNIT_STEINER_SETTING_H
#define TESTS_UNIT_STEINER_SETTING_H

#include "oracle.h"
#include "solver/steiner/dual/dual.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

struct setting {
	struct instance_case c;
	struct arena *arena;
	struct graph graph;
	struct steiner_options options;
	struct steiner_stats stats;
	struct tw_error error;
	struct search search;
};

/* A grid with diagonals: flat, a cylinder or a torus; ties in every fourth. */
static inline void setting_mesh(struct setting *s, uint64_t seed)
{
	uint64_t numbers = seed;
	*s = (struct setting){0};
	shape_grid(&s->c, 10 + (uint32_t)(seed % 9), 14, (int)(seed % 3), 1);
	weigh(&s->c, (uint32_t)(seed % 4), &numbers);
	place_terminals(&s->c, 3 + random_below(&numbers, 18), &numbers);
}

/* Starts a search on the case. */
static inline void setting_open(struct setting *s, uint64_t disable)
{
	s->options = (struct steiner_options){.disable = disable};
	s->arena = arena_new(0);
	assert_non_null(s->arena);
	assert_int_equal(
		graph_build(&s->graph, s->arena, s->c.vertex_count, s->c.edge_count, s->c.ends, s->c.weight, &s->error),
		TW_OK);
	uint32_t apart[2];
	s->search = (struct search){
		.graph = &s->graph,
		.terminals = s->c.terminal,
		.terminal_count = s->c.terminal_count,
		.options = &s->options,
		.stats = &s->stats,
		.arena = s->arena,
		.best_weight = UINT64_MAX,
		.best_edges = ARENA_ARRAY(s->arena, s->c.vertex_count, uint32_t),
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
		.stage = "test",
		.error = &s->error,
	};
	assert_int_equal(instance_init(&s->search.instance, s->arena, &s->graph, s->c.terminal, s->c.terminal_count,
				       NULL, true, apart),
			 TW_OK);
	assert_int_equal(primal_first(&s->search), TW_OK);
}

/* Every arc: the shares of all balls and what is left sum to its cost. And the radii sum to the bound. */
static inline void check_shares(const struct dual *dual)
{
	const struct instance *instance = dual->instance;
	const size_t arcs = 2 * (size_t)instance->edge_count;
	uint64_t *taken = calloc(arcs, sizeof *taken), bound = 0;
	uint64_t *distance = calloc(instance->vertex_count, sizeof *distance);
	assert_non_null(taken);
	assert_non_null(distance);
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		if (!ball->applied)
			continue;
		bound += ball->radius;
		for (uint32_t v = 0; v < instance->vertex_count; v++)
			distance[v] = ball->radius;
		for (uint32_t i = 0; i < ball->count; i++)
			distance[dual->member[ball->start + i].vertex] = dual->member[ball->start + i].distance;
		assert_true(distance[instance->terminal[dual->root]] == ball->radius);
		assert_true(distance[instance->terminal[ball->terminal]] == 0);
		for (uint32_t v = 0; v < instance->vertex_count; v++)
			for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++)
				if (distance[instance->head[a]] > distance[v])
					taken[a] += distance[instance->head[a]] - distance[v];
	}
	for (size_t a = 0; a < arcs; a++) {
		const fine_t cost = instance->weight[instance->edge[a]] >> dual->coarse_shift, most = 1u << 30;
		assert_true(taken[a] + dual->arc[a].cost == (cost < most ? cost : most));
	}
	assert_true(bound == dual->bound);
	free(taken);
	free(distance);
}

/* Deletes what the best tree rules out, and carries the dual over. False when nothing is left to prove. */
static inline int setting_shrink(struct setting *s, struct dual *dual)
{
	struct dual next;
	int empty = 0;
	const fine_t keep_best = search_cutoff(&s->search) + ((fine_t)1 << s->search.instance.shift);
	assert_int_equal(fix_by_reduced_costs(&s->search, dual, keep_best, &next, &empty), TW_OK);
	if (empty)
		return 0;
	*dual = next;
	assert_int_equal(dual_extend(dual, &s->search), TW_OK);
	return 1;
}

#endif
