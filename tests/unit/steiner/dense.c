/* Dense graphs, where exchanges of paths get stuck: a tree within a hundredth of the bound after little work. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

/* Weights as of SteinLib's I series: an edge costs about a hundred, twice that at a terminal, thrice between two. A
 * tree of shortest paths joins terminal to terminal; a light one goes round over the others. */
static uint64_t incidence_weight(uint32_t terminal_ends, uint64_t *numbers)
{
	uint64_t noise = 0;
	for (int i = 0; i < 4; i++)
		noise += random_next(numbers) % 10;
	return 100 * (1 + (uint64_t)terminal_ends) - 18 + noise;
}

struct dense {
	uint32_t vertex_count, edge_count, terminal_count;
	uint32_t *ends;
	uint64_t *weight;
	uint32_t *terminal;
	struct graph graph;
};

/* The terminals are the first vertices; all pairs, or a share of them and a star that holds all together. */
static void make_dense(struct dense *dense, struct arena *arena, uint32_t vertices, uint32_t terminals,
		       uint32_t percent, uint64_t seed)
{
	uint64_t numbers = seed;
	const size_t pairs = (size_t)vertices * (vertices - 1) / 2;
	*dense = (struct dense){
		.vertex_count = vertices,
		.terminal_count = terminals,
		.ends = ARENA_ARRAY(arena, 2 * pairs, uint32_t),
		.weight = ARENA_ARRAY(arena, pairs, uint64_t),
		.terminal = ARENA_ARRAY(arena, terminals, uint32_t),
	};
	assert_true(dense->ends && dense->weight && dense->terminal);
	for (uint32_t u = 0; u < vertices; u++)
		for (uint32_t v = u + 1; v < vertices; v++) {
			if (v + 1 < vertices && random_next(&numbers) % 100 >= percent)
				continue;
			const uint32_t e = dense->edge_count++;
			dense->ends[2 * e] = u;
			dense->ends[2 * e + 1] = v;
			dense->weight[e] =
				incidence_weight((uint32_t)(u < terminals) + (uint32_t)(v < terminals), &numbers);
		}
	for (uint32_t t = 0; t < terminals; t++)
		dense->terminal[t] = t;
	struct tw_error error = {0};
	assert_int_equal(
		graph_build(&dense->graph, arena, vertices, dense->edge_count, dense->ends, dense->weight, &error),
		TW_OK);
}

/* 300 million units are three seconds. The bound that the solver proves is the judge: no tree is lighter. */
static void trees_of_dense_graphs_are_near_their_bound(void **state)
{
	static const struct {
		uint32_t vertices, terminals, percent;
		double most; /* of weight over bound */
	} cases[] = {{320, 80, 100, 1.01}, {320, 80, 20, 1.03}, {640, 160, 20, 1.03}, {640, 25, 20, 1.025}};
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct arena *arena = arena_new(0);
		assert_non_null(arena);
		struct dense dense;
		make_dense(&dense, arena, cases[i].vertices, cases[i].terminals, cases[i].percent, 7 + i);
		const struct steiner_options options = {.work_limit = 150000000};
		struct steiner_tree tree;
		struct tw_error error = {0};
		assert_int_equal(steiner_solve(&dense.graph, dense.terminal, dense.terminal_count, &options, arena,
					       &tree, &error),
				 TW_OK);
		assert_int_equal(steiner_verify(&dense.graph, dense.terminal, dense.terminal_count, tree.edges,
						tree.edge_count, tree.weight, &error),
				 TW_OK);
		const double above = (double)tree.weight / (double)tree.lower_bound;
		if (above > cases[i].most)
			fail_msg("case %zu: %llu over a bound of %llu", i, (unsigned long long)tree.weight,
				 (unsigned long long)tree.lower_bound);
		arena_free(arena);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(trees_of_dense_graphs_are_near_their_bound),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
