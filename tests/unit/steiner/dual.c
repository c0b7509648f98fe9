/* The dual bound: what its balls claim is added up here arc by arc, from the members alone, with and without a guide,
 * through local search and deletion. */
#include "solver/steiner/dual/dual.h"
#include "oracle.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { CASES = 24, STEPS_EFFORT = 60000, ROUNDS = 6 };

struct setting {
	struct instance_case c;
	struct arena *arena;
	struct graph graph;
	struct steiner_options options;
	struct steiner_stats stats;
	struct tw_error error;
	struct search search;
};

static void set_up(struct setting *s, uint64_t seed, uint64_t disable)
{
	uint64_t numbers = seed;
	*s = (struct setting){.options = {.disable = disable}};
	shape_grid(&s->c, 10 + (uint32_t)(seed % 9), 14, (int)(seed % 3), 1);
	weigh(&s->c, (uint32_t)(seed % 4), &numbers);
	place_terminals(&s->c, 3 + random_below(&numbers, 18), &numbers);
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
static void check_shares(const struct dual *dual)
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
	for (size_t a = 0; a < arcs; a++)
		assert_true(taken[a] + dual->arc[a].cost == instance->weight[instance->edge[a]] >> dual->coarse_shift);
	assert_true(bound == dual->bound);
	free(taken);
	free(distance);
}

/* Deletes what the best tree rules out, and carries the dual over. False when nothing is left to prove. */
static int shrink(struct setting *s, struct dual *dual)
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

static void watch_bound(uint64_t disable)
{
	for (uint64_t seed = 0; seed < CASES; seed++) {
		struct setting s;
		struct dual dual;
		set_up(&s, seed, disable);
		assert_int_equal(dual_ascend_best(&dual, &s.search, 20000), TW_OK);
		check_shares(&dual);
		for (int round = 0; round < ROUNDS; round++) {
			const fine_t before = dual_fine_bound(&dual) + s.search.instance.base;
			assert_int_equal(dual_improve(&dual, &s.search, STEPS_EFFORT, FINE_MAX), TW_OK);
			assert_true(dual_fine_bound(&dual) + s.search.instance.base >= before);
			check_shares(&dual);
			/* Weights of whole trees are compared in the caller's units. */
			assert_true((dual_fine_bound(&dual) + s.search.instance.base) >> s.search.instance.shift <=
				    s.search.best_weight);
			if (!shrink(&s, &dual))
				break;
			assert_true(dual_fine_bound(&dual) + s.search.instance.base >= before);
			check_shares(&dual);
		}
		arena_free(s.arena);
	}
}

static void the_bound_never_falls_and_its_shares_add_up(void **state)
{
	(void)state;
	watch_bound(0);
}

static void it_does_so_without_a_guide(void **state)
{
	(void)state;
	watch_bound(STEINER_GUIDE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_bound_never_falls_and_its_shares_add_up),
		cmocka_unit_test(it_does_so_without_a_guide),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
