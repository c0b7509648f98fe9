/* A hundred thousand small random graphs: the solver's weight is the oracle's, whatever is switched off, however the
 * vertices are numbered and however many threads work. SEED=n or MESH_SEED=n in the environment
 * repeats one case. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { CASES = 100000, MESHES = 3900, FEATURES = 14, VARIANTS = FEATURES + 2 };

/* The oracle takes time that triples with every terminal: most cases have few. */
enum { FEW = 7, MANY = 14, ONE_IN = 61, ONE_MESH_IN = 101 };

static struct steiner_tree solve(const struct instance_case *c, const struct steiner_options *options,
				 struct arena *arena, uint64_t seed)
{
	struct graph graph;
	struct tw_error error = {0};
	struct steiner_tree tree = {0};
	enum tw_status status = graph_build(&graph, arena, c->vertex_count, c->edge_count, c->ends, c->weight, &error);
	if (status == TW_OK)
		status = steiner_solve(&graph, c->terminal, c->terminal_count, options, arena, &tree, &error);
	if (status == TW_OK && tree.outcome == STEINER_OPTIMAL) {
		status = steiner_verify(&graph, c->terminal, c->terminal_count, tree.edges, tree.edge_count,
					tree.weight, &error);
		assert_int_equal(tree.lower_bound, tree.weight);
	}
	if (status != TW_OK)
		fail_msg("case %llu, disabled %#llx: %s %s", (unsigned long long)seed,
			 (unsigned long long)options->disable, error.where, error.text);
	return tree;
}

static void expect(uint64_t expected, const struct instance_case *c, const struct steiner_options *options,
		   struct arena *arena, uint64_t seed, const char *variant)
{
	const struct steiner_tree tree = solve(c, options, arena, seed);
	const uint64_t found = tree.outcome == STEINER_OPTIMAL ? tree.weight : UNREACHED;
	const int right = expected == UNREACHED ? tree.outcome == STEINER_INFEASIBLE : found == expected;
	if (!right)
		fail_msg("case %llu (%s, disabled %#llx): outcome %d weight %llu, the oracle says %llu",
			 (unsigned long long)seed, variant, (unsigned long long)options->disable, (int)tree.outcome,
			 (unsigned long long)found, (unsigned long long)expected);
}

/* The case as it is, and one variant of it. `numbers` goes on from where the case was made. */
static void check_case(struct instance_case *c, uint64_t seed, uint64_t *numbers, struct arena *arena)
{
	const uint64_t expected = c->vertex_count <= 9 && seed % 4 == 0 ? oracle_brute(c) : oracle_dreyfus(c);
	const struct arena_mark mark = arena_mark(arena);
	expect(expected, c, &(struct steiner_options){0}, arena, seed, "plain");
	arena_release(arena, mark);

	const uint32_t variant = (uint32_t)(seed % VARIANTS);
	struct steiner_options options = {0};
	const char *name = "a feature off";
	if (variant < FEATURES) {
		options.disable = UINT64_C(1) << variant;
	} else if (variant == FEATURES) {
		case_shuffle(c, numbers);
		name = "shuffled";
	} else {
		/* Any set of features off, two threads. */
		options.threads = 2;
		options.disable = random_next(numbers) & ((1u << FEATURES) - 1) & ~(uint64_t)STEINER_DYNAMIC;
		name = "several off, two threads";
	}
	expect(expected, c, &options, arena, seed, name);
	arena_release(arena, mark);
}

static void a_hundred_thousand_small_graphs_equal_the_oracle(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const char *only = getenv("SEED");
	const uint64_t first = only ? strtoull(only, NULL, 10) : 0, end = only ? first + 1 : CASES;
	for (uint64_t seed = first; seed < end; seed++) {
		uint64_t numbers = seed;
		struct instance_case c;
		case_random(&c, seed % ONE_IN ? FEW : MANY, &numbers);
		check_case(&c, seed, &numbers, arena);
	}
	arena_free(arena);
}

static void meshes_of_some_hundred_vertices_equal_the_oracle(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const char *only = getenv("MESH_SEED");
	const uint64_t first = only ? strtoull(only, NULL, 10) : 0, end = only ? first + 1 : MESHES;
	for (uint64_t seed = first; seed < end; seed++) {
		uint64_t numbers = seed + 500000;
		struct instance_case c;
		case_mesh(&c, &numbers);
		if (seed % ONE_MESH_IN == 0)
			place_terminals(&c, MANY, &numbers);
		check_case(&c, seed, &numbers, arena);
	}
	arena_free(arena);
}

/* The dynamic program with next to nothing that prunes it: sets by the thousand, and start labels for each from many
 * pairs of others. */
static void the_dynamic_program_unpruned_equals_the_oracle(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const uint64_t most = (1u << FEATURES) - 1;
	for (uint64_t seed = 0; seed < 24; seed++) {
		uint64_t numbers = seed + 2000000;
		const struct steiner_options options = {.disable = most & ~(uint64_t)STEINER_DYNAMIC &
								   ~(seed % 2 ? (uint64_t)STEINER_GUESSING : 0)};
		struct instance_case c = {0};
		if (seed % 2)
			shape_grid(&c, 6, 6, (int)(seed % 3), 1);
		else /* few edges, so that a set has more start labels than arcs */
			shape_random(&c, 16 + random_below(&numbers, 16), random_below(&numbers, 4), &numbers);
		weigh(&c, (uint32_t)(seed % WEIGHT_KINDS), &numbers);
		place_terminals(&c, 11 + (uint32_t)(seed % 3), &numbers);
		const struct arena_mark mark = arena_mark(arena);
		expect(oracle_dreyfus(&c), &c, &options, arena, seed, "unpruned");
		arena_release(arena, mark);
	}
	arena_free(arena);
}

/* Every proof with the flow dual's bound and what it deletes, on graphs that the first attempt would solve. */
static void with_the_flow_dual_every_case_equals_the_oracle(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const uint64_t most = (1u << FEATURES) - 1;
	for (uint64_t seed = 0; seed < 12000; seed++) {
		uint64_t numbers = seed + 7000000;
		struct instance_case c;
		struct steiner_options options = {.disable = STEINER_EARLY};
		if (seed % 2)
			options.disable |= random_next(&numbers) & most & ~(uint64_t)(STEINER_DYNAMIC | STEINER_FLOW);
		if (seed % 8)
			case_random(&c, 8, &numbers);
		else
			case_mesh(&c, &numbers);
		const struct arena_mark mark = arena_mark(arena);
		expect(oracle_dreyfus(&c), &c, &options, arena, seed, "flow");
		arena_release(arena, mark);
	}
	arena_free(arena);
}

/* Nothing but branch and cut: no reductions, no good trees, no deletion before. */
static void branch_and_cut_alone_equals_the_oracle(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const struct steiner_options options = {.disable = ((1u << FEATURES) - 1) & ~(uint64_t)STEINER_CUTS};
	for (uint64_t seed = 0; seed < 6000; seed++) {
		uint64_t numbers = seed + 1000000;
		struct instance_case c;
		case_random(&c, 8, &numbers);
		const struct arena_mark mark = arena_mark(arena);
		expect(oracle_dreyfus(&c), &c, &options, arena, seed, "cuts alone");
		arena_release(arena, mark);
	}
	arena_free(arena);
}

static void the_two_oracles_agree(void **state)
{
	(void)state;
	uint32_t compared = 0;
	for (uint64_t seed = 0; seed < 4000; seed++) {
		uint64_t numbers = seed;
		struct instance_case c;
		case_random(&c, 7, &numbers);
		if (c.vertex_count > 10)
			continue;
		assert_int_equal(oracle_brute(&c), oracle_dreyfus(&c));
		compared++;
	}
	assert_true(compared > 500);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_two_oracles_agree),
		cmocka_unit_test(a_hundred_thousand_small_graphs_equal_the_oracle),
		cmocka_unit_test(meshes_of_some_hundred_vertices_equal_the_oracle),
		cmocka_unit_test(the_dynamic_program_unpruned_equals_the_oracle),
		cmocka_unit_test(with_the_flow_dual_every_case_equals_the_oracle),
		cmocka_unit_test(branch_and_cut_alone_equals_the_oracle),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
