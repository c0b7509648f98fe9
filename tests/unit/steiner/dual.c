/* The dual bound: what its balls claim is added up here arc by arc, from the members alone, with and without a guide,
 * through local search and deletion. */
#include "setting.h"

enum { CASES = 24, STEPS_EFFORT = 60000, ROUNDS = 6 };

static void watch_bound(uint64_t disable)
{
	for (uint64_t seed = 0; seed < CASES; seed++) {
		struct setting s;
		struct dual dual;
		setting_mesh(&s, seed);
		setting_open(&s, disable);
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
			if (!setting_shrink(&s, &dual))
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
