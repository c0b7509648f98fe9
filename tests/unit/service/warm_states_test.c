/* What a worker keeps of its last drags. */
#include "service/worker/warm_states.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void a_drag_finds_its_state_again(void **state)
{
	(void)state;
	struct warm_states *states = warm_states_new(0);
	assert_non_null(states);
	bool is_first = false;
	struct steiner_warm *one = warm_states_get(states, 1, &is_first);
	assert_true(one && is_first);
	struct steiner_warm *two = warm_states_get(states, -2, &is_first);
	assert_true(two && is_first && two != one);
	assert_ptr_equal(warm_states_get(states, 1, &is_first), one);
	assert_false(is_first);
	warm_states_free(states);
}

static void the_drag_that_was_used_longest_ago_makes_room(void **state)
{
	(void)state;
	struct warm_states *states = warm_states_new(0);
	assert_non_null(states);
	bool is_first = false;
	for (int64_t drag = 0; drag < WARM_STATES_MOST; drag++)
		assert_non_null(warm_states_get(states, drag, NULL));
	assert_non_null(warm_states_get(states, 0, &is_first));
	assert_false(is_first);
	assert_non_null(warm_states_get(states, 100, NULL));
	assert_non_null(warm_states_get(states, 0, &is_first));
	assert_false(is_first);
	assert_non_null(warm_states_get(states, 1, &is_first));
	assert_true(is_first);
	warm_states_free(states);
}

static void states_beyond_the_budget_go_but_for_the_last(void **state)
{
	(void)state;
	struct warm_states *states = warm_states_new(1);
	assert_non_null(states);
	bool is_first = false;
	for (int64_t drag = 0; drag < 3; drag++)
		assert_non_null(warm_states_get(states, drag, NULL));
	warm_states_settle(states);
	assert_non_null(warm_states_get(states, 2, &is_first));
	assert_false(is_first);
	assert_non_null(warm_states_get(states, 1, &is_first));
	assert_true(is_first);
	warm_states_free(states);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_drag_finds_its_state_again),
		cmocka_unit_test(the_drag_that_was_used_longest_ago_makes_room),
		cmocka_unit_test(states_beyond_the_budget_go_but_for_the_last),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
