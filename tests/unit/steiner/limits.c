/* Whenever and however the solver is stopped, it leaves a valid tree with a true bound, or a clear status. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

struct watch {
	uint32_t polls_left;
	const struct graph *graph;
	const struct instance_case *c;
	uint64_t optimum;
	uint64_t last_weight, last_bound, last_work;
};

static bool cancelled(void *context)
{
	struct watch *watch = context;
	return watch->polls_left == 0 || --watch->polls_left == 0;
}

/* Every report holds a valid tree, a true bound, and is no worse than the one before. */
static void progress(void *context, const struct steiner_progress *report)
{
	struct watch *watch = context;
	assert_non_null(report->stage);
	assert_true(report->lower_bound <= watch->optimum && report->lower_bound >= watch->last_bound);
	assert_true(report->weight <= watch->last_weight && report->work >= watch->last_work);
	if (report->weight != UINT64_MAX)
		assert_int_equal(steiner_verify(watch->graph, watch->c->terminal, watch->c->terminal_count,
						report->edges, report->edge_count, report->weight, NULL),
				 TW_OK);
	watch->last_weight = report->weight;
	watch->last_bound = report->lower_bound;
	watch->last_work = report->work;
}

/* A case that takes the solver a while: a grid of 256 vertices with nine terminals and awkward weights. */
static void case_long(struct instance_case *c, uint64_t seed)
{
	uint64_t state = seed * 77 + 5;
	*c = (struct instance_case){0};
	shape_grid(c, 16, 16, (int)(seed % 3), seed % 2 == 0);
	weigh(c, 1 + (uint32_t)(seed % (WEIGHT_KINDS - 1)), &state);
	place_terminals(c, 9, &state);
}

static void check_stopped(uint64_t seed, struct steiner_options options, uint32_t polls)
{
	struct instance_case c;
	case_long(&c, seed);
	struct arena *arena = arena_new(0);
	struct graph graph;
	struct tw_error error = {0};
	struct steiner_tree whole, tree;
	assert_non_null(arena);
	assert_int_equal(graph_build(&graph, arena, c.vertex_count, c.edge_count, c.ends, c.weight, &error), TW_OK);
	const struct steiner_options none = {0};
	assert_int_equal(steiner_solve(&graph, c.terminal, c.terminal_count, &none, arena, &whole, &error), TW_OK);
	assert_int_equal(whole.outcome, STEINER_OPTIMAL);

	struct watch watch = {polls, &graph, &c, whole.weight, UINT64_MAX, 0, 0};
	options.context = &watch;
	options.progress = progress;
	options.cancelled = polls ? cancelled : NULL;
	const enum tw_status status =
		steiner_solve(&graph, c.terminal, c.terminal_count, &options, arena, &tree, &error);
	if (status == TW_OK) {
		assert_true(tree.outcome != STEINER_INFEASIBLE);
		assert_true(tree.outcome != STEINER_CANCELLED || polls);
		assert_true(tree.lower_bound <= whole.weight && whole.weight <= tree.weight);
		assert_true(tree.outcome != STEINER_OPTIMAL || tree.weight == whole.weight);
		assert_int_equal(steiner_verify(&graph, c.terminal, c.terminal_count, tree.edges, tree.edge_count,
						tree.weight, &error),
				 TW_OK);
		assert_true(!options.memory_limit || tree.stats.memory_peak <= options.memory_limit);
	} else {
		assert_int_equal(status, polls ? TW_ERROR_CANCELLED : TW_ERROR_MEMORY);
		assert_true(*error.text != '\0');
	}
	arena_free(arena);
}

static void stopped_by_work_anywhere_it_leaves_a_valid_tree(void **state)
{
	(void)state;
	uint64_t numbers = 1;
	for (uint64_t seed = 0; seed < 150; seed++)
		check_stopped(seed,
			      (struct steiner_options){.work_limit = 1 + (random_next(&numbers) >> (40 + seed % 24))},
			      0);
}

static void cancelled_anywhere_it_leaves_a_valid_tree(void **state)
{
	(void)state;
	uint64_t numbers = 2;
	for (uint64_t seed = 0; seed < 150; seed++)
		check_stopped(seed, (struct steiner_options){0}, 1 + random_below(&numbers, 1u << seed % 8));
}

static void out_of_memory_anywhere_it_leaves_a_valid_tree_or_says_so(void **state)
{
	(void)state;
	uint64_t numbers = 3;
	for (uint64_t seed = 0; seed < 300; seed++)
		check_stopped(
			seed,
			(struct steiner_options){.memory_limit = 1 + random_below(&numbers, 1u << (10 + seed % 12))},
			0);
}

static void the_same_work_limit_gives_the_same_tree(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct instance_case c;
		case_long(&c, seed);
		struct arena *arena = arena_new(0);
		struct graph graph;
		struct tw_error error = {0};
		struct steiner_tree tree[2];
		assert_int_equal(graph_build(&graph, arena, c.vertex_count, c.edge_count, c.ends, c.weight, &error),
				 TW_OK);
		for (unsigned i = 0; i < 2; i++) {
			const struct steiner_options options = {.work_limit = 1000u << seed % 10, .threads = 1 + i};
			assert_int_equal(
				steiner_solve(&graph, c.terminal, c.terminal_count, &options, arena, &tree[i], &error),
				TW_OK);
		}
		assert_int_equal(tree[0].outcome, tree[1].outcome);
		assert_int_equal(tree[0].weight, tree[1].weight);
		assert_int_equal(tree[0].lower_bound, tree[1].lower_bound);
		assert_int_equal(tree[0].edge_count, tree[1].edge_count);
		assert_memory_equal(tree[0].edges, tree[1].edges, tree[0].edge_count * sizeof *tree[0].edges);
		arena_free(arena);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(stopped_by_work_anywhere_it_leaves_a_valid_tree),
		cmocka_unit_test(cancelled_anywhere_it_leaves_a_valid_tree),
		cmocka_unit_test(out_of_memory_anywhere_it_leaves_a_valid_tree_or_says_so),
		cmocka_unit_test(the_same_work_limit_gives_the_same_tree),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
