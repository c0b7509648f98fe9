/* Claims about the solver on degenerate and special instances, whose optima are known by their construction. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static struct arena *arena;

static int setup(void **state)
{
	(void)state;
	arena = arena_new(0);
	return arena == NULL;
}

static int teardown(void **state)
{
	(void)state;
	arena_free(arena);
	return 0;
}

static struct steiner_tree solve_with(const struct instance_case *c, const struct steiner_options *options)
{
	struct graph graph;
	struct tw_error error = {0};
	struct steiner_tree tree = {0};
	assert_int_equal(graph_build(&graph, arena, c->vertex_count, c->edge_count, c->ends, c->weight, &error), TW_OK);
	const enum tw_status status =
		steiner_solve(&graph, c->terminal, c->terminal_count, options, arena, &tree, &error);
	if (status != TW_OK)
		fail_msg("%s %s", error.where, error.text);
	if (tree.outcome != STEINER_INFEASIBLE) {
		assert_int_equal(steiner_verify(&graph, c->terminal, c->terminal_count, tree.edges, tree.edge_count,
						tree.weight, &error),
				 TW_OK);
		assert_true(tree.lower_bound <= tree.weight);
		for (uint32_t i = 1; i < tree.edge_count; i++)
			assert_true(tree.edges[i - 1] < tree.edges[i]);
	}
	return tree;
}

static struct steiner_tree solve(const struct instance_case *c)
{
	const struct steiner_tree tree = solve_with(c, &(struct steiner_options){0});
	if (tree.outcome != STEINER_INFEASIBLE)
		assert_int_equal(tree.outcome, STEINER_OPTIMAL);
	return tree;
}

static struct instance_case grid(uint32_t width, uint32_t height, uint32_t kind, uint64_t seed)
{
	struct instance_case c = {0};
	shape_grid(&c, width, height, 0, 0);
	weigh(&c, kind, &seed);
	return c;
}

static void one_terminal_needs_no_edge(void **state)
{
	(void)state;
	struct instance_case c = grid(4, 4, 3, 1);
	c.terminal_count = 1;
	c.terminal[0] = 5;
	const struct steiner_tree tree = solve(&c);
	assert_int_equal(tree.edge_count, 0);
	assert_int_equal(tree.weight, 0);
}

static void equal_terminals_count_once(void **state)
{
	(void)state;
	struct instance_case c = grid(4, 4, 0, 1);
	c.terminal_count = 5;
	memcpy(c.terminal, (uint32_t[]){5, 5, 5, 5, 5}, 5 * sizeof(uint32_t));
	assert_int_equal(solve(&c).edge_count, 0);
	memcpy(c.terminal, (uint32_t[]){0, 3, 0, 3, 3}, 5 * sizeof(uint32_t));
	assert_int_equal(solve(&c).weight, 3);
}

static void two_terminals_get_a_shortest_path(void **state)
{
	(void)state;
	struct instance_case c = grid(16, 16, 0, 1);
	c.terminal_count = 2;
	c.terminal[0] = 0;
	c.terminal[1] = 255;
	assert_int_equal(solve(&c).weight, 30);
}

static void a_single_vertex_is_a_graph(void **state)
{
	(void)state;
	struct instance_case c = {.vertex_count = 1, .terminal_count = 1};
	assert_int_equal(solve(&c).weight, 0);
}

static void terminals_apart_are_named(void **state)
{
	(void)state;
	struct instance_case c = {.vertex_count = 5, .edge_count = 2, .terminal_count = 3};
	memcpy(c.ends, (uint32_t[]){0, 1, 2, 3}, 4 * sizeof(uint32_t));
	c.weight[0] = c.weight[1] = 1;
	memcpy(c.terminal, (uint32_t[]){1, 0, 3}, 3 * sizeof(uint32_t));
	const struct steiner_tree tree = solve(&c);
	assert_int_equal(tree.outcome, STEINER_INFEASIBLE);
	assert_true((tree.terminal_a == 3) != (tree.terminal_b == 3));
	assert_true(tree.terminal_a < 4 && tree.terminal_b < 4);
	/* What is apart but holds no terminal does no harm. */
	c.terminal_count = 2;
	assert_int_equal(solve(&c).weight, 1);
}

static void bad_terminals_are_refused(void **state)
{
	(void)state;
	struct instance_case c = grid(3, 3, 0, 1);
	struct graph graph;
	struct tw_error error = {0};
	struct steiner_tree tree;
	assert_int_equal(graph_build(&graph, arena, c.vertex_count, c.edge_count, c.ends, c.weight, &error), TW_OK);
	const struct steiner_options options = {0};
	assert_int_equal(steiner_solve(&graph, c.terminal, 0, &options, arena, &tree, &error), TW_ERROR_INPUT);
	c.terminal[0] = 9;
	assert_int_equal(steiner_solve(&graph, c.terminal, 1, &options, arena, &tree, &error), TW_ERROR_INPUT);
}

static void zero_weights_give_a_tree_not_a_cycle(void **state)
{
	(void)state;
	struct instance_case c = grid(8, 8, 0, 1);
	memset(c.weight, 0, sizeof c.weight);
	c.terminal_count = 4;
	memcpy(c.terminal, (uint32_t[]){0, 7, 56, 63}, 4 * sizeof(uint32_t));
	assert_int_equal(solve(&c).weight, 0);
}

static void totals_of_62_bits_are_exact(void **state)
{
	(void)state;
	struct instance_case c = grid(3, 3, 0, 1);
	const uint64_t heavy = ((UINT64_C(1) << 62) - 1) / c.edge_count;
	for (uint32_t e = 0; e < c.edge_count; e++)
		c.weight[e] = heavy;
	c.terminal_count = 4;
	memcpy(c.terminal, (uint32_t[]){0, 2, 6, 8}, 4 * sizeof(uint32_t));
	assert_int_equal(solve(&c).weight, 6 * heavy);
	/* One unit of 2^58 decides. */
	for (uint32_t e = 0; e < c.edge_count; e++)
		c.weight[e] = heavy - (e == 0);
	assert_int_equal(solve(&c).weight, 6 * heavy - 1);
}

static void totals_beyond_62_bits_are_refused(void **state)
{
	(void)state;
	const uint32_t ends[] = {0, 1, 1, 2, 2, 3, 3, 0};
	const uint64_t totals[][4] = {
		{UINT64_C(1) << 63, UINT64_C(1) << 63, 0, 0}, /* wraps to 0 */
		{UINT64_MAX, UINT64_MAX, UINT64_MAX, 3},      /* wraps to 0 */
		{UINT64_C(1) << 61, UINT64_C(1) << 61, 0, 0}, /* 2^62 */
		{UINT64_MAX, 0, 0, 0},
	};
	struct graph graph;
	for (size_t i = 0; i < sizeof totals / sizeof *totals; i++) {
		struct tw_error error = {0};
		assert_int_equal(graph_build(&graph, arena, 4, 4, ends, totals[i], &error), TW_ERROR_INPUT);
		assert_true(*error.text != '\0');
	}
}

static void a_hub_of_250_spokes_is_no_trouble(void **state)
{
	(void)state;
	struct instance_case c = {.vertex_count = 251};
	for (uint32_t v = 1; v < 251; v++) {
		case_edge(&c, 0, v);
		case_edge(&c, v, v % 250 + 1);
	}
	for (uint32_t e = 0; e < c.edge_count; e++)
		c.weight[e] = e % 2 ? 3 : 2; /* spokes 2, rim 3 */
	c.terminal_count = 100;
	for (uint32_t i = 0; i < 100; i++)
		c.terminal[i] = 2 * i + 1;
	assert_int_equal(solve(&c).weight, 200);
}

/* All vertices terminals: a minimum spanning tree, here by Kruskal without sorting. */
static uint64_t spanning_weight(const struct instance_case *c)
{
	uint32_t group[CASE_VERTICES];
	uint8_t used[CASE_EDGES] = {0};
	uint64_t sum = 0;
	for (uint32_t v = 0; v < c->vertex_count; v++)
		group[v] = v;
	for (;;) {
		uint32_t best = c->edge_count;
		for (uint32_t e = 0; e < c->edge_count; e++)
			if (!used[e] && group[c->ends[2 * e]] != group[c->ends[2 * e + 1]] &&
			    (best == c->edge_count || c->weight[e] < c->weight[best]))
				best = e;
		if (best == c->edge_count)
			return sum;
		used[best] = 1;
		sum += c->weight[best];
		const uint32_t from = group[c->ends[2 * best]], to = group[c->ends[2 * best + 1]];
		for (uint32_t v = 0; v < c->vertex_count; v++)
			if (group[v] == from)
				group[v] = to;
	}
}

static void all_vertices_terminals_is_a_spanning_tree(void **state)
{
	(void)state;
	for (uint32_t kind = 0; kind < WEIGHT_KINDS; kind++) {
		struct instance_case c = grid(15, 15, kind, 7);
		c.terminal_count = c.vertex_count;
		for (uint32_t i = 0; i < c.vertex_count; i++)
			c.terminal[i] = i;
		assert_int_equal(solve(&c).weight, spanning_weight(&c));
	}
}

static void a_tree_with_130_terminals_is_cut_to_them(void **state)
{
	(void)state;
	uint64_t numbers = 3;
	struct instance_case c = {.vertex_count = 250};
	uint8_t needed[CASE_VERTICES] = {0};
	for (uint32_t v = 1; v < c.vertex_count; v++)
		case_edge(&c, v, v / 2);
	weigh(&c, 3, &numbers);
	c.terminal_count = 130;
	for (uint32_t i = 0; i < c.terminal_count; i++)
		needed[c.terminal[i] = c.vertex_count - 1 - i] = 1;
	/* Edge v - 1 leads up from v; the terminals lie on both sides of 1, and nothing needs 0. */
	uint64_t expected = 0;
	for (uint32_t v = c.vertex_count - 1; v > 1; v--)
		if (needed[v]) {
			expected += c.weight[v - 1];
			needed[v / 2] = 1;
		}
	assert_int_equal(solve(&c).weight, expected);
}

static void parallel_edges_give_the_lightest(void **state)
{
	(void)state;
	struct instance_case c = {.vertex_count = 3, .terminal_count = 2};
	for (uint32_t i = 0; i < 10; i++) {
		case_edge(&c, 0, 1);
		case_edge(&c, 2, 1);
	}
	for (uint32_t e = 0; e < c.edge_count; e++)
		c.weight[e] = 50 - 2 * e;
	c.terminal[0] = 0;
	c.terminal[1] = 2;
	const struct steiner_tree tree = solve(&c);
	assert_int_equal(tree.weight, 14 + 12);
	assert_int_equal(tree.edge_count, 2);
}

static void equal_input_gives_equal_bytes_for_any_number_of_threads(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct instance_case c = grid(16, 16, (uint32_t)(seed % WEIGHT_KINDS), seed);
		uint64_t numbers = seed + 100;
		place_terminals(&c, 9, &numbers);
		struct steiner_tree first = {0};
		for (unsigned threads = 0; threads < 4; threads++) {
			const struct steiner_tree tree = solve_with(&c, &(struct steiner_options){.threads = threads});
			if (!threads)
				first = tree;
			assert_int_equal(tree.weight, first.weight);
			assert_int_equal(tree.edge_count, first.edge_count);
			assert_memory_equal(tree.edges, first.edges, tree.edge_count * sizeof *tree.edges);
			assert_int_equal(tree.stats.work, first.stats.work);
			assert_int_equal(tree.stats.labels, first.stats.labels);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_terminal_needs_no_edge),
		cmocka_unit_test(equal_terminals_count_once),
		cmocka_unit_test(two_terminals_get_a_shortest_path),
		cmocka_unit_test(a_single_vertex_is_a_graph),
		cmocka_unit_test(terminals_apart_are_named),
		cmocka_unit_test(bad_terminals_are_refused),
		cmocka_unit_test(zero_weights_give_a_tree_not_a_cycle),
		cmocka_unit_test(totals_of_62_bits_are_exact),
		cmocka_unit_test(totals_beyond_62_bits_are_refused),
		cmocka_unit_test(a_hub_of_250_spokes_is_no_trouble),
		cmocka_unit_test(all_vertices_terminals_is_a_spanning_tree),
		cmocka_unit_test(a_tree_with_130_terminals_is_cut_to_them),
		cmocka_unit_test(parallel_edges_give_the_lightest),
		cmocka_unit_test(equal_input_gives_equal_bytes_for_any_number_of_threads),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
