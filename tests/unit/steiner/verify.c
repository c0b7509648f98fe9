/* Claims about the verifier: it accepts a tree and refuses every way to corrupt one. */
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* 0-1-2-3 in a row (edges 0 1 2, weights 5 0 7), 4 hangs on 1 (edge 3, weight 1), 0-2 (edge 4, weight 2), 5-6 apart
 * (edge 5, weight 4), and a parallel 2-3 (edge 6, weight 9). */
static const uint32_t ends[] = {0, 1, 1, 2, 2, 3, 1, 4, 0, 2, 5, 6, 3, 2};
static const uint64_t weight[] = {5, 0, 7, 1, 2, 4, 9};

static struct arena *arena;
static struct graph graph;

static int setup(void **state)
{
	(void)state;
	arena = arena_new(0);
	return !arena || graph_build(&graph, arena, 7, 7, ends, weight, NULL) != TW_OK;
}

static int teardown(void **state)
{
	(void)state;
	arena_free(arena);
	return 0;
}

static const char *verdict(const uint32_t *terminals, uint32_t terminal_count, const uint32_t *edges,
			   uint32_t edge_count, uint64_t claimed)
{
	static struct tw_error error;
	error = (struct tw_error){0};
	const enum tw_status status =
		steiner_verify(&graph, terminals, terminal_count, edges, edge_count, claimed, &error);
	return status == TW_OK ? "valid" : status == TW_ERROR_INTERNAL ? error.text : "another status";
}

#define LIST(...) ((const uint32_t[]){__VA_ARGS__})

static void accepts_a_tree(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(0, 1, 2), 3, 12), "valid");
	assert_string_equal(verdict(LIST(3, 0, 3), 3, LIST(2, 0, 1), 3, 12), "valid");
	assert_string_equal(verdict(LIST(0, 3, 4), 3, LIST(0, 1, 2, 3), 4, 13), "valid");
	assert_string_equal(verdict(LIST(4), 1, NULL, 0, 0), "valid");
	assert_string_equal(verdict(LIST(4, 4), 2, NULL, 0, 0), "valid");
	assert_string_equal(verdict(LIST(2, 3), 2, LIST(6), 1, 9), "valid");
}

static void refuses_a_wrong_weight(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(0, 1, 2), 3, 11), "the edges weigh 12, not 11 as claimed");
}

static void refuses_a_cycle_and_a_doubled_edge(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(0, 1, 2, 4), 4, 14), "closes a cycle");
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(0, 1, 2, 6), 4, 21), "closes a cycle");
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(0, 1, 2, 1), 4, 12), "stands in the tree twice");
}

static void refuses_a_forest(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 1, 5, 6), 4, LIST(0, 5), 2, 9),
			    "2 edges touch 4 vertices: more than one tree");
}

static void refuses_a_missing_terminal(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 1, 4), 3, LIST(0), 1, 5), "is not spanned");
	assert_string_equal(verdict(LIST(0, 4), 2, NULL, 0, 0), "is not spanned");
	assert_string_equal(verdict(LIST(0, 1, 5), 3, LIST(0), 1, 5), "is not spanned");
}

static void refuses_a_leaf_that_is_no_terminal(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 2), 2, LIST(0, 1, 3), 3, 6), "is a leaf but not a terminal");
}

static void refuses_what_is_not_in_the_graph(void **state)
{
	(void)state;
	assert_string_equal(verdict(LIST(0, 3), 2, LIST(7), 1, 0), "is not an edge of the graph");
	assert_string_equal(verdict(LIST(7), 1, NULL, 0, 0), "is not a vertex of the graph");
	assert_string_equal(verdict(NULL, 0, NULL, 0, 0), "there are no terminals");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(accepts_a_tree),
		cmocka_unit_test(refuses_a_wrong_weight),
		cmocka_unit_test(refuses_a_cycle_and_a_doubled_edge),
		cmocka_unit_test(refuses_a_forest),
		cmocka_unit_test(refuses_a_missing_terminal),
		cmocka_unit_test(refuses_a_leaf_that_is_no_terminal),
		cmocka_unit_test(refuses_what_is_not_in_the_graph),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
