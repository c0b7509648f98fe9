/* Threads change nothing but speed: outcome, tree, bound and statistics are the same bytes, also where a limit of work
 * or memory ends the search. `make config=thread test-unit` runs this under the thread sanitizer. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { SIDE = 48, MOST_THREADS = 3 };

/* A triangle mesh on which the dynamic program has thousands of sets. */
static void build_mesh(struct graph *graph, struct arena *arena, uint64_t seed)
{
	enum { ROOM = 3 * SIDE * SIDE };
	uint32_t *ends = ARENA_ARRAY(arena, 2 * ROOM, uint32_t);
	uint64_t *weight = ARENA_ARRAY(arena, ROOM, uint64_t);
	assert_true(ends && weight);
	const uint32_t count = mesh_edges(SIDE, 0, ends);
	for (uint32_t e = 0; e < count; e++)
		weight[e] = 10000 + random_next(&seed) % 9000;
	assert_int_equal(graph_build(graph, arena, SIDE * SIDE, count, ends, weight, NULL), TW_OK);
}

static void expect_equal(const struct steiner_tree *a, const struct steiner_tree *b)
{
	assert_int_equal(a->outcome, b->outcome);
	assert_int_equal(a->weight, b->weight);
	assert_int_equal(a->lower_bound, b->lower_bound);
	assert_int_equal(a->edge_count, b->edge_count);
	assert_memory_equal(a->edges, b->edges, a->edge_count * sizeof *a->edges);
	assert_int_equal(a->stats.work, b->stats.work);
	assert_int_equal(a->stats.labels, b->stats.labels);
	assert_int_equal(a->stats.sets, b->stats.sets);
	assert_int_equal(a->stats.branch_nodes, b->stats.branch_nodes);
	assert_int_equal(a->stats.vertices_left, b->stats.vertices_left);
	assert_int_equal(a->stats.edges_left, b->stats.edges_left);
	assert_int_equal(a->stats.memory_peak, b->stats.memory_peak);
}

/* Solves with 1, 2 and 3 threads; returns how many sets the dynamic program had. */
static uint64_t compare(uint64_t seed, struct steiner_options options)
{
	struct arena *arena = arena_new(0);
	struct graph graph;
	uint32_t terminal[24];
	struct steiner_tree first = {0};
	enum tw_status first_status = TW_OK;
	uint64_t numbers = seed + 9;
	assert_non_null(arena);
	build_mesh(&graph, arena, seed);
	for (uint32_t i = 0; i < 24; i++)
		terminal[i] = random_below(&numbers, SIDE * SIDE);
	for (options.threads = 1; options.threads <= MOST_THREADS; options.threads++) {
		struct steiner_tree tree;
		const enum tw_status status = steiner_solve(&graph, terminal, 24, &options, arena, &tree, NULL);
		if (options.threads == 1) {
			first = tree;
			first_status = status;
		}
		assert_int_equal(status, first_status);
		if (status == TW_OK)
			expect_equal(&tree, &first);
	}
	arena_free(arena);
	return first.stats.sets;
}

static void a_proof_is_the_same_for_every_number_of_threads(void **state)
{
	(void)state;
	uint64_t sets = 0;
	for (uint64_t seed = 0; seed < 6; seed++) {
		compare(seed, (struct steiner_options){0});
		/* Without a flow that would leave it little to do, the dynamic program begins at once. */
		sets += compare(seed, (struct steiner_options){.disable = STEINER_FLOW});
	}
	assert_true(sets > 1000);
}

/* Without the first attempt, the flow dual's iterations and splits decide what is deleted. */
static void a_proof_by_the_flow_dual_is_the_same_for_every_number_of_threads(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 6; seed++)
		compare(seed, (struct steiner_options){.disable = STEINER_EARLY});
}

/* The dynamic program alone, with hardly a bound: many more sets. */
static void the_dynamic_program_is_the_same_for_every_number_of_threads(void **state)
{
	(void)state;
	const uint64_t disable = STEINER_CUTS | STEINER_REASCENT;
	assert_true(compare(5, (struct steiner_options){.work_limit = 60000000, .disable = disable}) > 300);
}

static void a_work_limit_ends_in_the_same_place_for_every_number_of_threads(void **state)
{
	(void)state;
	uint64_t numbers = 1;
	for (uint64_t seed = 0; seed < 10; seed++)
		compare(seed, (struct steiner_options){.work_limit = 1 + random_below(&numbers, 20000000),
						       .disable = seed % 2 ? STEINER_FLOW : 0});
}

static void a_memory_limit_ends_in_the_same_place_for_every_number_of_threads(void **state)
{
	(void)state;
	uint64_t numbers = 2;
	for (uint64_t seed = 0; seed < 12; seed++)
		compare(seed % 3, (struct steiner_options){.memory_limit = 100000 + random_below(&numbers, 12000000),
							   .work_limit = 20000000,
							   .disable = seed % 2 ? STEINER_FLOW : 0});
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_proof_is_the_same_for_every_number_of_threads),
		cmocka_unit_test(a_proof_by_the_flow_dual_is_the_same_for_every_number_of_threads),
		cmocka_unit_test(the_dynamic_program_is_the_same_for_every_number_of_threads),
		cmocka_unit_test(a_work_limit_ends_in_the_same_place_for_every_number_of_threads),
		cmocka_unit_test(a_memory_limit_ends_in_the_same_place_for_every_number_of_threads),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
