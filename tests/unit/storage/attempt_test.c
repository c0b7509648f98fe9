/* Attempts that did not end in a result: remembered, tried again, and nobody else's harm. */
#include "tests/unit/storage/order.h"

#include "storage/attempt.h"

/* What failed together is tried again at different times, but the same job always at the same. */
static void retries_are_spread(void **state)
{
	struct fixture *f = *state;
	enum { JOBS = 40 };
	struct job_ticket tickets[JOBS];
	struct tw_error failure = {TW_ERROR_MEMORY, "out-of-memory", "", "no"};
	for (int i = 0; i < JOBS; i++)
		ORDER(f, 1, .priority = 0);
	for (int i = 0; i < JOBS; i++)
		assert_true(order_claim(f, order_query(), &tickets[i]));
	for (int i = 0; i < JOBS; i++)
		ok(f, job_fail(f->store, &tickets[i], &failure, true, &f->error));
	assert_true(fixture_ask(f, "SELECT count(DISTINCT pause_until_ms) FROM job") > JOBS / 2);
	assert_true(fixture_ask(f, "SELECT min(pause_until_ms) FROM job") >= f->now_ms + 1000);
	assert_true(fixture_ask(f, "SELECT max(pause_until_ms) FROM job") < f->now_ms + 1500);
	assert_true(fixture_ask(f, "SELECT max(pause_until_ms) - min(pause_until_ms) FROM job") > 300);
}

static void every_attempt_is_remembered_also_after_a_redrive(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct attempt *attempts = NULL;
	size_t count = 0;
	struct tw_error failure = {TW_ERROR_MEMORY, "out-of-memory", "", "too little"};
	ORDER(f, 1, .attempts_max = 2);
	for (int i = 0; i < 500; i++) {
		order_claim(f, order_query(), &ticket);
		ok(f, job_put_off(f->store, &ticket, 0, &f->error));
		f->now_ms += 2000;
	}
	order_claim(f, order_query(), &ticket);
	ok(f, job_fail(f->store, &ticket, &failure, true, &f->error));
	f->now_ms += 2000;
	order_claim(f, order_query(), &ticket);
	ok(f, job_abandon(f->store, "tester", true, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT state FROM job"), JOB_FAILED);
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	order_claim(f, order_query(), &ticket);
	f->now_ms += 700;
	ok(f, job_release(f->store, &ticket, &f->error));
	order_claim(f, order_query(), &ticket);
	fixture_finish(f, &ticket);
	static const struct {
		enum attempt_ending ending;
		uint32_t times, attempt;
	} expected[] = {
		{ATTEMPT_PUT_OFF, 500, 0}, {ATTEMPT_FAILED, 1, 1}, {ATTEMPT_CRASHED, 1, 2}, {ATTEMPT_RELEASED, 1, 0}};
	ok(f, attempt_list(f->store, ticket.job_id, &attempts, &count, &f->error));
	assert_int_equal(count, sizeof expected / sizeof *expected);
	for (size_t i = 0; i < count; i++) {
		assert_int_equal(attempts[i].ending, expected[i].ending);
		assert_int_equal(attempts[i].times, expected[i].times);
		assert_int_equal(attempts[i].attempt, expected[i].attempt);
		assert_string_equal(attempts[i].worker, "tester");
	}
	assert_string_equal(attempts[1].failure_type, "out-of-memory");
	assert_string_equal(attempts[1].failure_text, "too little");
	assert_int_equal(attempts[3].ended_ms - attempts[3].started_ms, 700);
	free(attempts);
}

static void a_history_has_an_end(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct attempt *attempts = NULL;
	size_t count = 0;
	ORDER(f, 1, .priority = 0);
	for (int i = 0; i < ATTEMPTS_KEPT + 50; i++) {
		order_claim(f, order_query(), &ticket);
		if (i % 2)
			ok(f, job_put_off(f->store, &ticket, 0, &f->error));
		else
			ok(f, job_release(f->store, &ticket, &f->error));
		f->now_ms += 2000;
	}
	ok(f, attempt_list(f->store, ticket.job_id, &attempts, &count, &f->error));
	assert_int_equal(count, ATTEMPTS_KEPT);
	assert_int_equal(attempts[count - 1].ended_ms, f->now_ms - 2000);
	free(attempts);
	ok(f, attempt_list(f->store, "job_nothing", &attempts, &count, &f->error));
	assert_int_equal(count, 0);
	free(attempts);
}

/* It kills whoever takes it. Those behind it in its own lane wait for its three attempts, nobody else does. */
static void a_job_that_kills_its_workers_starves_nobody(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	int64_t poison = ORDER(f, 1, .priority = 9);
	int64_t behind = ORDER(f, 1, .priority = 0);
	int others = 0, claims = 0;
	for (int i = 0; i < 3; i++)
		ORDER(f, 2, .priority = 0);
	for (int64_t job = 0; (job = order_claim(f, order_query(), &ticket)) != behind; claims++) {
		assert_true(claims < 10);
		others += order_field(f, job, "client") == 2;
		if (job == poison)
			ok(f, job_abandon(f->store, "tester", true, &f->error));
		else
			fixture_finish(f, &ticket);
	}
	assert_int_equal(order_field(f, poison, "state"), JOB_FAILED);
	assert_in_range(others, 2, 3);
}

/* A host is drained or reloaded as often as one likes. */
static void a_job_that_is_handed_over_loses_no_attempt_and_no_place(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	int64_t first = ORDER(f, 1, .group = "cutter");
	ORDER(f, 1, .group = "cutter");
	for (int i = 0; i < 8; i++) {
		assert_int_equal(order_claim(f, order_query(), &ticket), first);
		assert_int_equal(ticket.attempt, 1);
		if (i % 2)
			ok(f, job_release(f->store, &ticket, &f->error));
		else
			ok(f, job_abandon(f->store, "tester", false, &f->error));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		FAST_TEST(retries_are_spread),
		FAST_TEST(every_attempt_is_remembered_also_after_a_redrive),
		FAST_TEST(a_history_has_an_end),
		FAST_TEST(a_job_that_kills_its_workers_starves_nobody),
		FAST_TEST(a_job_that_is_handed_over_loses_no_attempt_and_no_place),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
