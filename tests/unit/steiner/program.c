/* One terminal set of the dynamic program: however many start labels it is given, in whatever order, what it keeps are
 * the distances from them. */
#include "oracle.h"
#include "solver/steiner/program/grow.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { SIDE = 6, VERTICES = SIDE * SIDE, STARTS = 5000, SETS = 200 };

static void any_number_of_start_labels_gives_their_distances(void **state)
{
	(void)state;
	uint64_t numbers = 7;
	struct instance_case c = {0};
	shape_grid(&c, SIDE, SIDE, 0, 0);
	weigh(&c, 3, &numbers);
	c.terminal_count = 2;
	c.terminal[0] = 0;
	c.terminal[1] = VERTICES - 1;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	struct graph graph;
	struct tw_error error = {0};
	struct steiner_stats stats = {0};
	const struct steiner_options options = {.disable = STEINER_SEPARATORS | STEINER_FUTURE_COST};
	assert_int_equal(graph_build(&graph, arena, c.vertex_count, c.edge_count, c.ends, c.weight, &error), TW_OK);
	struct search search = {
		.graph = &graph,
		.terminals = c.terminal,
		.terminal_count = 2,
		.options = &options,
		.stats = &stats,
		.arena = arena,
		.best_weight = UINT64_MAX,
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
	};
	uint32_t apart[2];
	assert_int_equal(instance_init(&search.instance, arena, &graph, c.terminal, 2, NULL, false, apart), TW_OK);
	const struct instance *instance = &search.instance;
	struct dp_grower grower;
	assert_int_equal(dp_grower_init(&grower, &search, NULL, (fine_t)1 << 100), TW_OK);
	for (uint32_t set = 0; set < SETS; set++) {
		const uint32_t member = 0;
		const uint64_t bits = 1;
		uint64_t distance[VERTICES];
		struct dp_label labels[VERTICES];
		struct dp_trail trails[VERTICES];
		uint32_t useful;
		for (uint32_t v = 0; v < VERTICES; v++)
			distance[v] = UNREACHED;
		dp_grow_start(&grower, &member, 1, &bits);
		/* Ever lighter ones at a few vertices: each replaces the one before. */
		for (uint32_t i = 0; i < STARTS; i++) {
			const uint32_t v = random_below(&numbers, 1 + set % VERTICES);
			const uint64_t cost = 10 * (STARTS - i) + random_below(&numbers, 30);
			dp_grow_add(&grower, v, cost, INSTANCE_NONE);
			if (cost < distance[v])
				distance[v] = cost;
		}
		for (uint32_t round = 0; round < VERTICES; round++)
			for (uint32_t e = 0; e < 2 * instance->edge_count; e++) {
				const uint32_t u = instance->ends[e], v = instance->ends[e ^ 1];
				const uint64_t longer = distance[u] + (uint64_t)instance->weight[e / 2];
				if (longer < distance[v])
					distance[v] = longer;
			}
		assert_int_equal(dp_grow(&grower, labels, &useful, trails), VERTICES);
		assert_int_equal(useful, VERTICES);
		for (uint32_t i = 0; i < useful; i++)
			assert_true(labels[i].cost == distance[labels[i].vertex]);
	}
	arena_free(arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(any_number_of_start_labels_gives_their_distances),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
