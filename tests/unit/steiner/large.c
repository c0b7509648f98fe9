/* Large graphs: whenever and however the solver is stopped, it leaves a valid tree with a true bound, or a clear
 * status, and keeps to its budget of memory. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { SIDE = 340, LARGE_SIDE = 1000, LIGHT_SIDE = 200, TERMINALS = 10 };

struct large {
	struct arena *arena;
	struct graph graph;
	uint32_t terminal_count;
	uint32_t terminal[2048];
};

static void build(struct large *large, uint32_t vertex_count, uint32_t edge_count, const uint32_t *ends,
		  const uint64_t *weight)
{
	struct tw_error error = {0};
	if (graph_build(&large->graph, large->arena, vertex_count, edge_count, ends, weight, &error) != TW_OK)
		fail_msg("%s", error.text);
}

/* Triangles over side * side vertices, weights like a mesh's or, `light`, zeros and ties; nothing joins the last row to
 * the others. */
static void make_mesh(struct large *large, uint32_t side, int light)
{
	large->arena = arena_new(0);
	assert_non_null(large->arena);
	const size_t room = 3 * (size_t)side * side;
	uint32_t *ends = ARENA_ARRAY(large->arena, 2 * room, uint32_t);
	uint64_t *weight = ARENA_ARRAY(large->arena, room, uint64_t), numbers = 1;
	assert_true(ends && weight);
	const uint32_t count = mesh_edges(side, 1, ends);
	for (uint32_t e = 0; e < count; e++)
		weight[e] = light ? random_next(&numbers) % 3 : 10000 + random_next(&numbers) % 5000;
	build(large, side * side, count, ends, weight);
}

static void place(struct large *large, uint32_t count, uint64_t seed)
{
	const uint32_t rows = large->graph.vertex_count / 100 * 99;
	large->terminal_count = count;
	for (uint32_t i = 0; i < count; i++)
		large->terminal[i] = random_below(&seed, rows);
}

static enum tw_status solve(struct large *large, const struct steiner_options *options, struct steiner_tree *tree)
{
	struct tw_error error = {0};
	const enum tw_status status = steiner_solve(&large->graph, large->terminal, large->terminal_count, options,
						    large->arena, tree, &error);
	if (status != TW_OK) {
		assert_true(*error.text != '\0');
		return status;
	}
	assert_true(!options->memory_limit || tree->stats.memory_peak <= options->memory_limit);
	if (tree->outcome != STEINER_INFEASIBLE) {
		assert_true(tree->lower_bound <= tree->weight);
		assert_int_equal(steiner_verify(&large->graph, large->terminal, large->terminal_count, tree->edges,
						tree->edge_count, tree->weight, &error),
				 TW_OK);
	}
	return TW_OK;
}

/* The mesh of 115,600 vertices and its optimum, which the tests of limits share. */
static struct large mesh;
static uint64_t optimum;

static int setup(void **state)
{
	(void)state;
	struct steiner_tree tree;
	make_mesh(&mesh, SIDE, 0);
	place(&mesh, TERMINALS, 3);
	assert_int_equal(solve(&mesh, &(struct steiner_options){0}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_OPTIMAL);
	optimum = tree.weight;
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	arena_free(mesh.arena);
	return 0;
}

static void expect_between(const struct steiner_tree *tree)
{
	assert_true(tree->lower_bound <= optimum && optimum <= tree->weight);
	assert_true(tree->outcome != STEINER_OPTIMAL || tree->weight == optimum);
}

static void stopped_by_work_anywhere_it_leaves_a_valid_tree(void **state)
{
	(void)state;
	uint64_t numbers = 1;
	for (uint32_t i = 0; i < 6; i++) {
		struct steiner_tree tree;
		const uint64_t limit = 1 + random_below(&numbers, 60000000);
		assert_int_equal(solve(&mesh, &(struct steiner_options){.work_limit = limit}, &tree), TW_OK);
		expect_between(&tree);
	}
}

static void out_of_memory_anywhere_it_leaves_a_valid_tree_or_says_so(void **state)
{
	(void)state;
	uint64_t numbers = 2;
	uint32_t trees = 0, refusals = 0;
	for (uint32_t i = 0; i < 16; i++) {
		struct steiner_tree tree;
		const struct steiner_options options = {
			.memory_limit = (size_t)1 << (20 + i % 8) | random_below(&numbers, 1u << (20 + i % 8)),
			.work_limit = 40000000,
		};
		const enum tw_status status = solve(&mesh, &options, &tree);
		trees += status == TW_OK;
		refusals += status == TW_ERROR_MEMORY;
		if (status == TW_OK)
			expect_between(&tree);
		else
			assert_int_equal(status, TW_ERROR_MEMORY);
	}
	assert_true(trees > 0 && refusals > 0);
}

static bool countdown(void *context)
{
	uint32_t *left = context;
	return *left == 0 || --*left == 0;
}

static void cancelled_anywhere_it_leaves_a_valid_tree_or_says_so(void **state)
{
	(void)state;
	uint64_t numbers = 3;
	for (uint32_t i = 0; i < 8; i++) {
		struct steiner_tree tree;
		uint32_t left = 1 + random_below(&numbers, 2u << i);
		const enum tw_status status =
			solve(&mesh, &(struct steiner_options){.cancelled = countdown, .context = &left}, &tree);
		if (status == TW_OK)
			expect_between(&tree);
		else
			assert_int_equal(status, TW_ERROR_CANCELLED);
	}
}

static void two_thousand_terminals_get_a_tree_and_a_bound(void **state)
{
	(void)state;
	struct steiner_tree tree;
	place(&mesh, 2000, 4);
	assert_int_equal(solve(&mesh, &(struct steiner_options){.work_limit = 130000000}, &tree), TW_OK);
	assert_true(tree.lower_bound > tree.weight / 2);
	place(&mesh, TERMINALS, 3);
}

static void a_million_vertices_are_solved(void **state)
{
	(void)state;
	struct large large;
	struct steiner_tree tree;
	make_mesh(&large, LARGE_SIDE, 0);
	/* Three terminals near each other, one of them twice: proven. */
	large.terminal_count = 4;
	memcpy(large.terminal, (uint32_t[]){300200, 302230, 300200, 330215}, 4 * sizeof(uint32_t));
	assert_int_equal(solve(&large, &(struct steiner_options){0}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_OPTIMAL);
	/* A hundred all over: a tree and a bound. */
	place(&large, 100, 5);
	assert_int_equal(solve(&large, &(struct steiner_options){.work_limit = 1}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_LIMIT);
	/* One in the row that is apart. */
	large.terminal[99] = LARGE_SIDE * LARGE_SIDE - 1;
	assert_int_equal(solve(&large, &(struct steiner_options){0}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_INFEASIBLE);
	assert_int_equal(tree.terminal_b, LARGE_SIDE * LARGE_SIDE - 1);
	arena_free(large.arena);
}

static void zeros_and_ties_everywhere_are_no_trouble(void **state)
{
	(void)state;
	struct large large;
	struct steiner_tree tree;
	make_mesh(&large, LIGHT_SIDE, 1);
	place(&large, TERMINALS, 6);
	assert_int_equal(solve(&large, &(struct steiner_options){0}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_OPTIMAL);
	arena_free(large.arena);
}

/* A wheel: spokes of 2, a rim of 3, terminals on every third vertex of the rim. */
static void a_hub_of_100000_spokes_is_no_trouble(void **state)
{
	(void)state;
	enum { SPOKES = 100000, WHEEL_TERMINALS = 150 };
	struct large large = {.arena = arena_new(0), .terminal_count = WHEEL_TERMINALS};
	assert_non_null(large.arena);
	uint32_t *ends = ARENA_ARRAY(large.arena, 4 * (size_t)SPOKES, uint32_t);
	uint64_t *weight = ARENA_ARRAY(large.arena, 2 * (size_t)SPOKES, uint64_t);
	assert_true(ends && weight);
	for (uint32_t i = 0; i < SPOKES; i++) {
		const uint32_t row[4] = {0, i + 1, i + 1, (i + 1) % SPOKES + 1};
		memcpy(ends + 4 * (size_t)i, row, sizeof row);
		weight[2 * i] = 2;
		weight[2 * i + 1] = 3;
	}
	build(&large, SPOKES + 1, 2 * SPOKES, ends, weight);
	for (uint32_t i = 0; i < WHEEL_TERMINALS; i++)
		large.terminal[i] = 1 + 3 * i;
	struct steiner_tree tree;
	assert_int_equal(solve(&large, &(struct steiner_options){0}, &tree), TW_OK);
	assert_int_equal(tree.outcome, STEINER_OPTIMAL);
	assert_int_equal(tree.weight, 2 * WHEEL_TERMINALS);
	arena_free(large.arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(stopped_by_work_anywhere_it_leaves_a_valid_tree),
		cmocka_unit_test(out_of_memory_anywhere_it_leaves_a_valid_tree_or_says_so),
		cmocka_unit_test(cancelled_anywhere_it_leaves_a_valid_tree_or_says_so),
		cmocka_unit_test(two_thousand_terminals_get_a_tree_and_a_bound),
		cmocka_unit_test(a_million_vertices_are_solved),
		cmocka_unit_test(zeros_and_ties_everywhere_are_no_trouble),
		cmocka_unit_test(a_hub_of_100000_spokes_is_no_trouble),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
