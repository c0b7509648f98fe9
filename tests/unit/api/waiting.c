/* Who waits for which job, and who is the last. */
#include "api/waiting.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void the_last_to_leave_is_told_so(void **state)
{
	(void)state;
	struct waiting *waiting = waiting_new();
	struct waiter waiters[5], never = {.is_waiting = false};
	/* In the middle, at the beginning and at the end of a list; others wait for another job. */
	static const int order[] = {2, 4, 0, 3};
	for (int i = 0; i < 5; i++)
		waiting_join(waiting, &waiters[i], i == 1 ? "job_b" : "job_a", 1);
	for (int i = 0; i < 4; i++)
		assert_int_equal(waiting_leave(waiting, &waiters[order[i]], true), i == 3);
	assert_true(waiting_leave(waiting, &waiters[1], true));
	assert_false(waiting_leave(waiting, &waiters[1], true)); /* it does not wait any more */
	assert_false(waiting_leave(waiting, &never, true));
	waiting_free(waiting);
}

static void the_last_knows_of_the_latest_request(void **state)
{
	(void)state;
	struct waiting *waiting = waiting_new();
	struct waiter first, second, third;
	waiting_join(waiting, &first, "job_a", 1);
	waiting_join(waiting, &second, "job_a", 2);
	waiting_join(waiting, &third, "job_a", 3);
	assert_false(waiting_leave(waiting, &third, true));
	assert_false(waiting_leave(waiting, &second, true));
	assert_true(waiting_leave(waiting, &first, true));
	assert_int_equal(first.requests, 3);
	/* Somebody who came for the same afterwards begins anew. */
	waiting_join(waiting, &second, "job_a", 1);
	assert_true(waiting_leave(waiting, &second, true));
	assert_int_equal(second.requests, 1);
	waiting_free(waiting);
}

/* Who has waited long enough, or has only looked on, wants the job as before. */
static void what_is_not_given_up_is_not_handed_on(void **state)
{
	(void)state;
	struct waiting *waiting = waiting_new();
	struct waiter first, second;
	waiting_join(waiting, &first, "job_a", 1);
	waiting_join(waiting, &second, "job_a", 2);
	assert_false(waiting_leave(waiting, &second, false));
	assert_true(waiting_leave(waiting, &first, true));
	assert_int_equal(first.requests, 1);
	waiting_free(waiting);
}

/* More jobs than the table has places. */
static void jobs_do_not_disturb_each_other(void **state)
{
	enum { JOBS = 5000 };
	static struct waiter waiters[2][JOBS];
	(void)state;
	struct waiting *waiting = waiting_new();
	for (int copy = 0; copy < 2; copy++)
		for (int i = 0; i < JOBS; i++) {
			char id[STORE_ID_SIZE];
			snprintf(id, sizeof id, "job_%d", i);
			waiting_join(waiting, &waiters[copy][i], id, 1 + copy);
		}
	for (int copy = 0; copy < 2; copy++)
		for (int i = 0; i < JOBS; i++)
			assert_int_equal(waiting_leave(waiting, &waiters[1 - copy][i], true), copy == 1);
	for (int i = 0; i < JOBS; i++)
		assert_int_equal(waiters[0][i].requests, 2);
	waiting_free(waiting);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_last_to_leave_is_told_so),
		cmocka_unit_test(the_last_knows_of_the_latest_request),
		cmocka_unit_test(what_is_not_given_up_is_not_handed_on),
		cmocka_unit_test(jobs_do_not_disturb_each_other),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
