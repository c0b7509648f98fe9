/* The flow dual: whatever its floats say, the balls that it is split into add up, and their bound is none that the
 * optimum is below. On meshes it is better than what ascents reach. */
#include "solver/steiner/flow/flow.h"
#include "setting.h"

enum { GRAPHS = 400, MESHES = 24, ITERATIONS = 15, MESH_ITERATIONS = 30, ROUNDS = 4 };

static fine_t whole_bound(const struct setting *s, const struct dual *dual)
{
	return dual_fine_bound(dual) + s->search.instance.base;
}

/* The bound in the caller's units, rounded up: a tree's weight is whole. Tie-breaks count as nothing. */
static uint64_t proves(const struct setting *s, const struct dual *dual)
{
	return (uint64_t)(whole_bound(s, dual) >> s->search.instance.shift);
}

static void no_bound_exceeds_the_optimum(void **state)
{
	(void)state;
	uint32_t tight = 0, split = 0;
	for (uint64_t seed = 0; seed < GRAPHS; seed++) {
		struct setting s = {0};
		struct dual first, dual;
		struct flow *flow;
		uint64_t numbers = seed + 6000000;
		case_random(&s.c, 9, &numbers);
		const uint64_t optimum = oracle_dreyfus(&s.c);
		if (optimum >= UNREACHED)
			continue;
		setting_open(&s, 0);
		if (s.search.instance.terminal_count > 1) {
			assert_int_equal(dual_ascend_best(&first, &s.search, 1000), TW_OK);
			assert_int_equal(flow_new(&flow, &s.search, &first), TW_OK);
			assert_int_equal(dual_init_like(&dual, &s.search, &first, flow_members(flow)), TW_OK);
			for (uint32_t round = 0; round < ROUNDS; round++) {
				assert_int_equal(flow_iterate(flow, &s.search, ITERATIONS), TW_OK);
				assert_int_equal(flow_split(flow, &s.search, &dual), TW_OK);
				check_shares(&dual);
				assert_true(proves(&s, &dual) <= optimum);
			}
			tight += (double)proves(&s, &dual) >= 0.97 * (double)optimum;
			split++;
		}
		arena_free(s.arena);
	}
	assert_true(split > GRAPHS / 2 && tight > split / 10 * 9);
}

static void it_is_better_than_ascents_on_meshes_and_survives_deletion(void **state)
{
	(void)state;
	uint32_t better = 0, deletions = 0;
	for (uint64_t seed = 0; seed < MESHES; seed++) {
		struct setting s;
		struct dual dual, rival;
		struct flow *flow;
		setting_mesh(&s, seed);
		setting_open(&s, 0);
		assert_int_equal(dual_ascend_best(&dual, &s.search, 200000), TW_OK);
		const fine_t ascended = whole_bound(&s, &dual);
		assert_int_equal(flow_new(&flow, &s.search, &dual), TW_OK);
		fine_t best = 0;
		for (uint32_t round = 0; round < ROUNDS; round++) {
			assert_int_equal(flow_iterate(flow, &s.search, MESH_ITERATIONS), TW_OK);
			assert_int_equal(dual_init_like(&rival, &s.search, &dual, flow_members(flow)), TW_OK);
			assert_int_equal(flow_split(flow, &s.search, &rival), TW_OK);
			check_shares(&rival);
			assert_true(proves(&s, &rival) <= s.search.best_weight);
			best = whole_bound(&s, &rival) > best ? whole_bound(&s, &rival) : best;
			if (rival.bound > dual.bound)
				dual = rival;
			if (!setting_shrink(&s, &dual))
				break;
			check_shares(&dual);
			/* Every other round the flow goes on with edges that are no more. */
			if (round % 2 && s.search.instance.edge_count < flow_edges(flow)) {
				assert_int_equal(flow_shrink(&flow, &s.search, &dual), TW_OK);
				assert_int_equal(flow_edges(flow), s.search.instance.edge_count);
				deletions++;
			}
		}
		better += best >= ascended;
		arena_free(s.arena);
	}
	assert_true(better > MESHES / 2 && deletions > MESHES / 4);
}

static void what_does_not_fit_is_refused_and_leaves_nothing_behind(void **state)
{
	(void)state;
	struct setting s;
	struct dual dual;
	struct flow *flow;
	setting_mesh(&s, 1);
	setting_open(&s, 0);
	assert_int_equal(dual_ascend_best(&dual, &s.search, 20000), TW_OK);
	const size_t used = arena_used(s.arena);
	for (size_t limit = used; limit < used + 600000; limit += 20000) {
		struct arena *arena = s.search.arena;
		s.options.memory_limit = limit;
		const enum tw_status status = flow_new(&flow, &s.search, &dual);
		assert_true(status == TW_OK || (status == TW_ERROR_MEMORY && !flow && arena_used(arena) == used));
		if (limit == used)
			assert_int_equal(status, TW_ERROR_MEMORY);
		if (status == TW_OK)
			break;
	}
	assert_non_null(flow);
	arena_free(s.arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_bound_exceeds_the_optimum),
		cmocka_unit_test(it_is_better_than_ascents_on_meshes_and_survives_deletion),
		cmocka_unit_test(what_does_not_fit_is_refused_and_leaves_nothing_behind),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
