/* Who is served before whom: classes, clients, groups, and warm workers. */
#include "tests/unit/storage/order.h"

#include "storage/attempt.h"
#include "storage/bulk.h"

/* --- classes ---------------------------------------------------------------------------------------------------- */

static void interactive_jobs_go_before_normal_ones_before_batches(void **state)
{
	struct fixture *f = *state;
	int64_t batch = ORDER(f, 1, .class = JOB_BATCH, .priority = 9);
	int64_t normal = ORDER(f, 1, .priority = 5);
	int64_t urgent = ORDER(f, 2, .class = JOB_INTERACTIVE);
	assert_int_equal(order_next(f), urgent);
	assert_int_equal(order_next(f), normal);
	assert_int_equal(order_next(f), batch);
	assert_int_equal(order_next(f), 0);
}

/* The number of claims, one after the other, until one of the class comes; each is finished at once. */
static int claims_until(struct fixture *f, enum job_class class)
{
	for (int claims = 1; claims < 1000; claims++) {
		struct job_ticket ticket;
		int64_t job = order_claim(f, order_query(), &ticket);
		assert_true(job);
		fixture_finish(f, &ticket);
		if (order_field(f, job, "class") == (int64_t) class)
			return claims;
	}
	return 1000;
}

static void of_sixteen_claims_one_goes_to_a_class_that_waits(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 80; i++)
		ORDER(f, i % 5, .class = JOB_INTERACTIVE);
	for (int i = 0; i < 4; i++) {
		ORDER(f, 1, .class = JOB_NORMAL);
		ORDER(f, 1, .class = JOB_BATCH);
	}
	/* The last class first, then the one before it, which has waited as long. */
	assert_int_equal(claims_until(f, JOB_BATCH), 16);
	assert_int_equal(claims_until(f, JOB_NORMAL), 1);
	assert_int_equal(claims_until(f, JOB_BATCH), 15);
	assert_int_equal(claims_until(f, JOB_NORMAL), 2);
}

/* A designer's next job comes when the one before is done; in between, a batch has its turns anyway. */
static void a_batch_that_has_its_turns_overtakes_no_designer(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 60; i++)
		ORDER(f, 1, .class = JOB_BATCH);
	for (int i = 0; i < 50; i++) {
		int64_t urgent = ORDER(f, 2, .class = JOB_INTERACTIVE);
		assert_int_equal(order_next(f), urgent);
		assert_int_equal(order_field(f, order_next(f), "class"), JOB_BATCH);
	}
}

static void a_worker_that_is_kept_for_designers_takes_nothing_else(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct claim_query query = order_query();
	query.classes = JOB_CLASS_BIT(JOB_INTERACTIVE);
	ORDER(f, 1, .class = JOB_BATCH);
	ORDER(f, 1, .class = JOB_NORMAL);
	assert_int_equal(order_claim(f, query, &ticket), 0);
	for (int i = 0; i < 40; i++) {
		int64_t urgent = ORDER(f, 1, .class = JOB_INTERACTIVE);
		assert_int_equal(order_claim(f, query, &ticket), urgent);
		fixture_finish(f, &ticket);
	}
	assert_int_equal(order_claim(f, query, &ticket), 0);
}

/* --- clients ---------------------------------------------------------------------------------------------------- */

static void clients_take_turns_however_much_each_has_queued(void **state)
{
	struct fixture *f = *state;
	static const int64_t expected[] = {1, 2, 3, 1, 2, 1, 2, 1, 1, 1};
	for (int i = 0; i < 6; i++)
		ORDER(f, 1, .priority = 7);
	for (int i = 0; i < 3; i++)
		ORDER(f, 2, .priority = 0);
	ORDER(f, 3, .priority = -7);
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
		assert_int_equal(order_field(f, order_next(f), "client"), expected[i]);
}

static void a_weightier_client_has_more_turns(void **state)
{
	struct fixture *f = *state;
	int turns[3] = {0};
	for (int i = 0; i < 40; i++) {
		ORDER(f, 1, .weight = 3);
		ORDER(f, 2, .priority = 0);
	}
	for (int i = 0; i < 40; i++)
		turns[order_field(f, order_next(f), "client")]++;
	assert_in_range(turns[1], 29, 31);
	/* What was said of a client holds until something else is. */
	ORDER(f, 2, .weight = 3);
	turns[1] = turns[2] = 0;
	for (int i = 0; i < 16; i++)
		turns[order_field(f, order_next(f), "client")]++;
	assert_in_range(turns[1], 7, 9);
}

static void a_client_saves_no_turns_while_it_asks_for_nothing(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 60; i++)
		ORDER(f, 1 + i % 2, .priority = 0);
	for (int i = 0; i < 30; i++)
		order_next(f);
	for (int i = 0; i < 10; i++)
		ORDER(f, 3, .priority = 0);
	for (int i = 0; i < 5; i++) {
		unsigned seen = 0;
		for (int k = 0; k < 3; k++)
			seen |= 1u << order_field(f, order_next(f), "client");
		assert_int_equal(seen, 1u << 1 | 1u << 2 | 1u << 3);
	}
}

static void what_a_client_had_while_it_was_alone_is_not_held_against_it(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 60; i++)
		ORDER(f, 1, .priority = 0);
	for (int i = 0; i < 50; i++)
		order_next(f);
	for (int i = 0; i < 10; i++)
		ORDER(f, 2, .priority = 0);
	for (int i = 0; i < 5; i++)
		assert_int_not_equal(order_field(f, order_next(f), "client"), order_field(f, order_next(f), "client"));
}

/* Groups do not make more of a client. */
static void a_client_with_many_groups_has_one_turn(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 20; i++) {
		char group[32];
		snprintf(group, sizeof group, "order-%d", i);
		ORDER(f, 1, .group = group);
		ORDER(f, 2, .priority = 0);
	}
	for (int i = 0; i < 20; i++)
		assert_int_not_equal(order_field(f, order_next(f), "client"), order_field(f, order_next(f), "client"));
}

static void priority_holds_across_the_groups_of_a_client(void **state)
{
	struct fixture *f = *state;
	int64_t low = ORDER(f, 1, .group = "a");
	int64_t high = ORDER(f, 1, .group = "b", .priority = 3);
	int64_t middle = ORDER(f, 1, .priority = 2);
	int64_t higher = ORDER(f, 1, .group = "a", .max_running = 2, .priority = 4);
	assert_int_equal(order_next(f), higher);
	assert_int_equal(order_next(f), high);
	assert_int_equal(order_next(f), middle);
	assert_int_equal(order_next(f), low);
}

/* --- groups ----------------------------------------------------------------------------------------------------- */

static void a_group_runs_so_many_at_a_time_and_others_go_on(void **state)
{
	struct fixture *f = *state;
	int64_t first = ORDER(f, 1, .group = "cutter", .max_running = 2);
	int64_t second = ORDER(f, 2, .group = "cutter");
	int64_t third = ORDER(f, 1, .group = "cutter", .class = JOB_INTERACTIVE);
	int64_t fourth = ORDER(f, 1, .group = "cutter");
	int64_t other = ORDER(f, 1, .priority = -1);
	struct job_ticket tickets[2];
	assert_int_equal(order_claim(f, order_query(), &tickets[0]), third);
	int64_t next = order_claim(f, order_query(), &tickets[1]);
	assert_true(next == first || next == second);
	assert_int_equal(order_next(f), other);
	assert_int_equal(order_next(f), 0);
	fixture_finish(f, &tickets[0]);
	assert_true(order_next(f));
	assert_int_equal(order_next(f), 0);
	ok(f, job_release(f->store, &tickets[1], &f->error));
	assert_true(order_next(f));
	assert_int_equal(order_next(f), 0);
	/* The latest request decides how many. */
	ORDER(f, 1, .group = "cutter", .max_running = 3);
	assert_true(order_next(f));
	assert_int_equal(order_next(f), 0);
	ORDER(f, 1, .group = "cutter", .max_running = 1);
	assert_int_equal(order_next(f), 0);
	(void)fourth;
}

static void a_group_is_left_however_a_job_ends(void **state)
{
	struct fixture *f = *state;
	struct tw_error failure = {TW_ERROR_INPUT, "wrong", "", "wrong"};
	for (int way = 0; way < 6; way++) {
		struct job_ticket ticket;
		struct job job;
		enum job_state after;
		int64_t number = ORDER(f, 1, .group = "cutter");
		assert_int_equal(order_claim(f, order_query(), &ticket), number);
		assert_int_equal(fixture_ask(f, "SELECT running FROM job_group"), 1);
		ok(f, job_get(f->store, TENANT_DEFAULT, ticket.job_id, &job, &f->error));
		assert_string_equal(job.group, "cutter");
		job_clear(&job);
		if (way == 0)
			fixture_finish(f, &ticket);
		if (way == 1)
			ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
		if (way == 2)
			ok(f, job_abandon(f->store, "tester", false, &f->error));
		if (way == 3)
			f->now_ms += 5001;
		if (way == 4)
			ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
		if (way == 4)
			ok(f, job_release(f->store, &ticket, &f->error));
		if (way == 5)
			ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, ticket.resource_id, false,
					      &f->error));
		ok(f, job_expire(f->store, &f->error));
		assert_int_equal(fixture_ask(f, "SELECT running FROM job_group"), 0);
		assert_int_equal(fixture_ask(f, "SELECT count(*) FROM lane WHERE blocked = 1"), 0);
		if (way == 2 || way == 3)
			ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	}
}

/* --- warm workers ----------------------------------------------------------------------------------------------- */

static void a_worker_prefers_what_it_has_in_memory_for(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct claim_query query = order_query();
	const int64_t drag = job_affinity("field_1", "drag"), other_drag = job_affinity("field_1", "other");
	assert_true(drag && drag != other_drag && drag >> 32 == other_drag >> 32);
	assert_true(drag >> 32 != job_affinity("field_2", "drag") >> 32);
	query.affinities = &drag;
	query.affinity_count = 1;
	int64_t foreign = ORDER(f, 1, .affinity = job_affinity("field_2", "drag"));
	int64_t same_field = ORDER(f, 1, .affinity = other_drag, .session = "other");
	int64_t same_drag = ORDER(f, 1, .affinity = drag, .session = "drag");
	int64_t urgent = ORDER(f, 1, .priority = 1);
	assert_int_equal(order_claim(f, query, &ticket), urgent);
	assert_int_equal(order_claim(f, query, &ticket), same_drag);
	assert_string_equal(ticket.session, "drag");
	assert_true(ticket.affinity == drag);
	assert_int_equal(order_claim(f, query, &ticket), same_field);
	assert_int_equal(order_claim(f, query, &ticket), foreign);
}

static void no_job_is_passed_over_for_long_because_a_worker_is_warm(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct claim_query query = order_query();
	const int64_t warm = job_affinity("field_1", NULL);
	query.affinities = &warm;
	query.affinity_count = 1;
	int64_t cold = ORDER(f, 1, .priority = 0);
	for (int i = 0; i < 30; i++)
		ORDER(f, 1, .affinity = warm);
	int claims = 1;
	while (order_claim(f, query, &ticket) != cold)
		claims++;
	assert_int_equal(claims, PICK_PREFERRED_MAX + 1);
	/* And from behind the window nothing is fetched. */
	for (int i = 0; i < 20; i++)
		ORDER(f, 2, .priority = 0);
	ORDER(f, 2, .affinity = warm);
	int64_t first = fixture_ask(f, "SELECT min(number) FROM job WHERE client = 2");
	int64_t claimed = 0;
	while (order_field(f, claimed = order_claim(f, query, &ticket), "client") != 2)
		;
	assert_int_equal(claimed, first);
}

/* --- many at once ----------------------------------------------------------------------------------------------- */

static void many_are_cancelled_by_query(void **state)
{
	struct fixture *f = *state;
	struct bulk_progress progress = {0};
	for (int i = 0; i < 130; i++)
		ORDER(f, 1, .class = JOB_BATCH, .group = i % 2 ? "night" : "day", .max_running = 1000);
	ORDER(f, 1, .group = "night");
	f->now_ms += 1000;
	ORDER(f, 1, .class = JOB_BATCH, .group = "night");
	assert_int_equal(order_field(f, order_next(f), "class"), JOB_NORMAL);
	int64_t running = order_next(f);
	assert_int_equal(order_field(f, running, "class"), JOB_BATCH);
	const struct job_query query = {.tenant = TENANT_DEFAULT,
					.classes = JOB_CLASS_BIT(JOB_BATCH),
					.group = "day",
					.created_before_ms = f->now_ms};
	struct job_page page;
	struct job_query listed = query;
	listed.limit = 1000;
	ok(f, job_list(f->store, &listed, &page, &f->error));
	assert_int_equal(page.count, 65);
	job_page_clear(&page);
	while (!progress.done)
		ok(f, bulk_step(f->store, BULK_CANCEL, &query, &progress, &f->error));
	assert_int_equal(progress.changed, 65);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 4"), 64);
	assert_int_equal(order_field(f, running, "cancel_requested"), JOB_CANCEL_ASKED);
	/* What is left of the lanes tells of nothing that is not there. */
	for (int i = 0; i < 65; i++) {
		struct job_ticket ticket;
		order_claim(f, order_query(), &ticket);
		fixture_finish(f, &ticket);
	}
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0"), 1);
}

/* A claim that finds a hundred lanes emptied still finds the job behind them, and takes no write lock when idle again.
 */
static void emptied_lanes_hide_nothing(void **state)
{
	struct fixture *f = *state;
	struct bulk_progress progress = {0};
	for (int i = 0; i < 150; i++) {
		char group[32];
		snprintf(group, sizeof group, "order-%d", i);
		ORDER(f, i, .group = group);
	}
	const struct job_query query = {.tenant = TENANT_DEFAULT};
	while (!progress.done)
		ok(f, bulk_step(f->store, BULK_CANCEL, &query, &progress, &f->error));
	int64_t last = ORDER(f, 999, .class = JOB_BATCH);
	assert_int_equal(order_next(f), last);
	struct store_writes before, after;
	assert_int_equal(order_next(f), 0);
	store_count_writes(f->store, &before);
	assert_int_equal(order_next(f), 0);
	store_count_writes(f->store, &after);
	assert_int_equal(after.transactions, before.transactions);
}

static void class_and_cancel_names_are_words(void **state)
{
	(void)state;
	for (enum job_class class = JOB_INTERACTIVE; class < JOB_CLASSES_END; class ++) {
		enum job_class back = JOB_CLASS_UNSAID;
		assert_true(job_class_by_name(job_class_name(class), &back));
		assert_int_equal(back, class);
	}
	assert_false(job_class_by_name("urgent", &(enum job_class){0}));
	assert_string_equal(job_cancel_name(JOB_CANCEL_DEADLINE), "deadline");
	assert_string_equal(attempt_ending_name(ATTEMPT_PUT_OFF), "put_off");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		FAST_TEST(interactive_jobs_go_before_normal_ones_before_batches),
		FAST_TEST(of_sixteen_claims_one_goes_to_a_class_that_waits),
		FAST_TEST(a_batch_that_has_its_turns_overtakes_no_designer),
		FAST_TEST(a_worker_that_is_kept_for_designers_takes_nothing_else),
		FAST_TEST(clients_take_turns_however_much_each_has_queued),
		FAST_TEST(a_weightier_client_has_more_turns),
		FAST_TEST(a_client_saves_no_turns_while_it_asks_for_nothing),
		FAST_TEST(what_a_client_had_while_it_was_alone_is_not_held_against_it),
		FAST_TEST(a_client_with_many_groups_has_one_turn),
		FAST_TEST(priority_holds_across_the_groups_of_a_client),
		FAST_TEST(a_group_runs_so_many_at_a_time_and_others_go_on),
		FAST_TEST(a_group_is_left_however_a_job_ends),
		FAST_TEST(a_worker_prefers_what_it_has_in_memory_for),
		FAST_TEST(no_job_is_passed_over_for_long_because_a_worker_is_warm),
		FAST_TEST(many_are_cancelled_by_query),
		FAST_TEST(emptied_lanes_hide_nothing),
		cmocka_unit_test(class_and_cancel_names_are_words),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
