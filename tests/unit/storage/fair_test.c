/* Who is served before whom: classes, clients, groups, and when. */
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

/* --- when ------------------------------------------------------------------------------------------------------- */

static int64_t next_due_ms(struct fixture *f)
{
	int64_t wait_ms = 0;
	ok(f, job_next_due(f->store, &wait_ms, &f->error));
	return wait_ms;
}

static void a_job_does_not_begin_before_its_time(void **state)
{
	struct fixture *f = *state;
	assert_int_equal(next_due_ms(f), -1);
	int64_t late = ORDER(f, 1, .not_before_ms = f->now_ms + 7000, .priority = 5);
	int64_t other = ORDER(f, 1, .not_before_ms = f->now_ms - 7000);
	assert_int_equal(order_next(f), other);
	assert_int_equal(order_next(f), 0);
	assert_int_equal(next_due_ms(f), 5001); /* the lease of the other */
	f->now_ms += 4000;
	ok(f, job_abandon(f->store, "tester", false, &f->error));
	assert_int_equal(order_next(f), other);
	assert_int_equal(next_due_ms(f), 3000);
	f->now_ms += 2999;
	assert_int_equal(order_next(f), 0);
	f->now_ms += 1;
	assert_int_equal(next_due_ms(f), 0);
	assert_int_equal(order_next(f), late);
}

/* However many are due at once, a claim ends the delay of some dozens only, and all come. */
static void many_that_are_due_at_once_all_come(void **state)
{
	struct fixture *f = *state;
	for (int i = 0; i < 150; i++)
		ORDER(f, 1, .not_before_ms = f->now_ms + 1000);
	f->now_ms += 1000;
	assert_true(order_next(f));
	assert_in_range(fixture_ask(f, "SELECT count(*) FROM job WHERE delayed = 1"), 50, 149);
	for (int i = 1; i < 150; i++)
		assert_true(order_next(f));
	assert_int_equal(order_next(f), 0);
}

static void a_deadline_ends_a_queued_and_a_running_job(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	struct job job;
	bool cancel = false;
	int64_t running = ORDER(f, 1, .cancel_after_ms = 3000);
	int64_t queued = ORDER(f, 1, .cancel_after_ms = 2000, .priority = -1);
	int64_t lasting = ORDER(f, 1, .priority = -2);
	assert_int_equal(order_claim(f, order_query(), &ticket), running);
	assert_int_equal(next_due_ms(f), 2000);
	f->now_ms += 2000;
	ok(f, job_expire(f->store, &f->error));
	assert_int_equal(order_field(f, queued, "state"), JOB_CANCELLED);
	assert_int_equal(order_field(f, queued, "cancel_requested"), JOB_CANCEL_DEADLINE);
	ok(f, job_heartbeat(f->store, &ticket, 0, NULL, NULL, &cancel, &f->error));
	assert_false(cancel);
	assert_int_equal(next_due_ms(f), 1000);
	f->now_ms += 1000;
	assert_int_equal(order_next(f), lasting); /* a claim sees to it, too */
	ok(f, job_heartbeat(f->store, &ticket, 0, NULL, NULL, &cancel, &f->error));
	assert_true(cancel);
	fixture_finish(f, &ticket);
	ok(f, job_get(f->store, TENANT_DEFAULT, ticket.job_id, &job, &f->error));
	assert_int_equal(job.state, JOB_CANCELLED);
	assert_int_equal(job.cancel_cause, JOB_CANCEL_DEADLINE);
	job_clear(&job);
	f->now_ms += 3600 * 1000;
	ok(f, job_expire(f->store, &f->error));
	assert_int_equal(order_field(f, lasting, "state"), JOB_QUEUED);
}

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

/* --- one job in place of another -------------------------------------------------------------------------------- */

static void a_later_job_with_the_same_word_supersedes(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	bool cancel = false;
	int64_t running = ORDER(f, 1, .supersedes = "drag");
	assert_int_equal(order_claim(f, order_query(), &ticket), running);
	int64_t others[] = {ORDER(f, 2, .supersedes = "drag"), ORDER(f, 1, .supersedes = "pull"),
			    ORDER(f, 1, .priority = 0)};
	int64_t queued = ORDER(f, 1, .supersedes = "drag", .class = JOB_INTERACTIVE);
	ok(f, job_heartbeat(f->store, &ticket, 0, NULL, NULL, &cancel, &f->error));
	assert_true(cancel);
	int64_t last = ORDER(f, 1, .supersedes = "drag");
	assert_int_equal(order_field(f, queued, "state"), JOB_CANCELLED);
	assert_int_equal(order_field(f, queued, "cancel_requested"), JOB_CANCEL_SUPERSEDED);
	fixture_finish(f, &ticket);
	assert_int_equal(order_field(f, running, "state"), JOB_CANCELLED);
	for (size_t i = 0; i < sizeof others / sizeof *others; i++)
		assert_int_equal(order_field(f, others[i], "state"), JOB_QUEUED);
	assert_int_equal(order_field(f, last, "state"), JOB_QUEUED);
	/* Another tenant's client with the same number is another client. */
	int64_t tenant = 0;
	ok(f, tenant_create(f->store, "mill", &tenant, &f->error));
	struct resource resource;
	enum resource_outcome outcome;
	const struct resource_draft draft = {.owner = {tenant, 1}, .kind = RESOURCE_LAYOUT, .queue.supersedes = "drag"};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	assert_int_equal(order_field(f, last, "state"), JOB_QUEUED);
}

static int64_t field(struct fixture *f, int64_t client, struct job_request request)
{
	struct resource resource;
	enum resource_outcome outcome;
	const struct resource_draft draft = {.owner = {TENANT_DEFAULT, client},
					     .kind = RESOURCE_FIELD,
					     .options = "{\"strip\":5}",
					     .queue = request};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	return fixture_ask(f, "SELECT max(number) FROM job WHERE kind = 2");
}
#define FIELD(f, client, ...) field((f), (client), (struct job_request){__VA_ARGS__})

static void an_equal_request_makes_a_job_as_urgent_as_it_is(void **state)
{
	struct fixture *f = *state;
	int64_t slow = FIELD(f, 1, .class = JOB_BATCH, .cancel_after_ms = 1000, .supersedes = "a", .transient = true);
	assert_int_equal(order_field(f, slow, "transient"), 1);
	int64_t normal = ORDER(f, 2, .priority = 0);
	assert_int_equal(FIELD(f, 2, .class = JOB_INTERACTIVE, .cancel_after_ms = 9000, .transient = true), slow);
	assert_int_equal(order_field(f, slow, "transient"), 2);
	/* It has a deadline as long as all have one: the last. And who asks for it besides is not superseded. */
	f->now_ms += 1000;
	ORDER(f, 1, .class = JOB_BATCH, .supersedes = "a");
	assert_int_equal(order_next(f), slow);
	assert_int_equal(order_field(f, slow, "client"), 2);
	assert_int_equal(FIELD(f, 2, .class = JOB_BATCH), slow);
	ORDER(f, 2, .class = JOB_BATCH, .supersedes = "a");
	assert_int_equal(order_field(f, slow, "cancel_requested"), JOB_CANCEL_NONE);
	assert_int_equal(order_field(f, slow, "class"), JOB_INTERACTIVE);
	assert_int_equal(order_field(f, slow, "transient"), 0);
	assert_int_equal(order_field(f, slow, "cancel_at_ms"), 0);
	assert_int_equal(order_next(f), normal);
}

/* A designer's layout must not wait behind the batch that its field is in. */
static void what_an_urgent_job_needs_is_as_urgent(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE];
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = {TENANT_DEFAULT, 1},
				       .kind = RESOURCE_FIELD,
				       .queue = {.class = JOB_BATCH, .cancel_after_ms = 100},
				       .need_count = 1};
	for (int i = 0; i < 5; i++)
		ORDER(f, 1, .priority = 0);
	fixture_create(f, RESOURCE_MESH, "v 0 0 0", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_MOTION, "frames", mesh, NULL, motion);
	draft.needs = (const char *[]){motion};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	draft.needs = (const char *[]){resource.id};
	draft.kind = RESOURCE_LAYOUT;
	draft.owner.client = 2;
	draft.queue = (struct job_request){.class = JOB_INTERACTIVE, .priority = 3};
	resource_clear(&resource);
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	/* As the batch was asked for again, and nothing of that has made it wait. */
	draft.needs = (const char *[]){motion};
	draft.kind = RESOURCE_FIELD;
	draft.queue = (struct job_request){.class = JOB_BATCH, .cancel_after_ms = 100};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_EXISTED);
	resource_clear(&resource);
	f->now_ms += 1000;
	static const enum job_kind chain[] = {JOB_IMPORT_MESH, JOB_IMPORT_MOTION, JOB_COMPUTE_FIELD,
					      JOB_COMPUTE_LAYOUT};
	for (size_t i = 0; i < 4; i++) {
		struct job_ticket ticket;
		assert_true(order_claim(f, order_query(), &ticket));
		assert_int_equal(ticket.kind, chain[i]);
		assert_int_equal(order_field(f, ticket.number, "class"), JOB_INTERACTIVE);
		fixture_finish(f, &ticket);
	}
}

static void what_an_equal_request_needs_becomes_as_urgent_too(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE];
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = {TENANT_DEFAULT, 1}, .kind = RESOURCE_FIELD, .need_count = 1};
	fixture_create(f, RESOURCE_MESH, "v 0 0 0", NULL, NULL, mesh);
	draft.needs = (const char *[]){mesh};
	for (int i = 0; i < 2; i++) {
		draft.queue.class = i ? JOB_INTERACTIVE : JOB_BATCH;
		ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
		resource_clear(&resource);
		assert_int_equal(fixture_ask(f, "SELECT class FROM job WHERE kind = 0"),
				 i ? JOB_INTERACTIVE : JOB_NORMAL);
	}
}

/* Its worker may have stopped already, or not have noticed. */
static void a_job_that_is_to_stop_goes_on_where_it_is_wanted_again(void **state)
{
	static const struct tw_error stopped = {.status = TW_ERROR_CANCELLED};
	struct fixture *f = *state;
	struct job_ticket ticket;
	bool cancel = false;
	int64_t job = FIELD(f, 1, .supersedes = "a", .cancel_after_ms = 100, .group = "g");
	assert_int_equal(order_claim(f, order_query(), &ticket), job);
	int64_t other = ORDER(f, 1, .supersedes = "a");
	ok(f, job_heartbeat(f->store, &ticket, 0, NULL, NULL, &cancel, &f->error));
	assert_true(cancel);
	f->now_ms += 200;
	assert_int_equal(FIELD(f, 1, .supersedes = "a", .cancel_after_ms = 500), job);
	assert_int_equal(order_field(f, other, "state"), JOB_CANCELLED);
	assert_int_equal(order_field(f, job, "cancel_at_ms"), f->now_ms + 500);
	ok(f, job_fail(f->store, &ticket, &stopped, false, &f->error));
	assert_int_equal(order_field(f, job, "state"), JOB_QUEUED);
	assert_int_equal(order_field(f, job, "attempts"), 0);
	assert_int_equal(order_claim(f, order_query(), &ticket), job);
	ORDER(f, 1, .supersedes = "a");
	assert_int_equal(order_field(f, job, "cancel_requested"), JOB_CANCEL_SUPERSEDED);
	assert_int_equal(FIELD(f, 2, .priority = 0), job);
	fixture_finish(f, &ticket);
	assert_int_equal(order_field(f, job, "state"), JOB_SUCCEEDED);
	assert_int_equal(fixture_ask(f, "SELECT running FROM job_group"), 0);
}

/* Back where it was before: what was begun since is of no use any more. */
static void a_request_for_what_is_there_supersedes_too(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	int64_t made = FIELD(f, 1, .priority = 0);
	assert_int_equal(order_claim(f, order_query(), &ticket), made);
	fixture_finish(f, &ticket);
	int64_t since = ORDER(f, 1, .supersedes = "a"), another = ORDER(f, 2, .supersedes = "a");
	assert_int_equal(FIELD(f, 1, .priority = 0), made);
	assert_int_equal(order_field(f, since, "state"), JOB_QUEUED);
	assert_int_equal(FIELD(f, 1, .supersedes = "a"), made);
	assert_int_equal(order_field(f, since, "cancel_requested"), JOB_CANCEL_SUPERSEDED);
	assert_int_equal(order_field(f, made, "state"), JOB_SUCCEEDED);
	assert_int_equal(order_field(f, another, "state"), JOB_QUEUED);
}

/* One licence is one licence, however urgent a job has become; and what runs is counted once. */
static void who_hastens_a_job_leaves_it_in_its_group(void **state)
{
	struct fixture *f = *state;
	struct job_ticket first, ticket;
	int64_t running = ORDER(f, 1, .class = JOB_BATCH, .group = "licence", .max_running = 1);
	assert_int_equal(order_claim(f, order_query(), &first), running);
	int64_t shared = FIELD(f, 1, .class = JOB_BATCH, .group = "licence");
	assert_int_equal(FIELD(f, 2, .class = JOB_INTERACTIVE), shared);
	assert_int_equal(order_field(f, shared, "class"), JOB_INTERACTIVE);
	assert_int_equal(order_next(f), 0);
	fixture_finish(f, &first);
	assert_int_equal(order_claim(f, order_query(), &ticket), shared);
	assert_int_equal(fixture_ask(f, "SELECT running FROM job_group"), 1);
	assert_int_equal(FIELD(f, 3, .priority = 7), shared);
	fixture_finish(f, &ticket);
	assert_int_equal(fixture_ask(f, "SELECT running FROM job_group"), 0);
}

static void an_equal_request_supersedes_what_it_says(void **state)
{
	struct fixture *f = *state;
	int64_t shared = FIELD(f, 1, .priority = 0);
	int64_t earlier = ORDER(f, 2, .supersedes = "drag");
	assert_int_equal(FIELD(f, 2, .supersedes = "drag", .class = JOB_INTERACTIVE), shared);
	assert_int_equal(order_field(f, earlier, "state"), JOB_CANCELLED);
	/* But what another wants as well is not superseded in its turn. */
	ORDER(f, 2, .supersedes = "drag");
	assert_int_equal(order_next(f), shared);
}

static void a_job_that_is_asked_for_again_goes_by_the_new_request(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket;
	enum job_state after;
	int64_t job = FIELD(f, 1, .class = JOB_BATCH, .cancel_after_ms = 100);
	f->now_ms += 200;
	assert_int_equal(order_next(f), 0);
	assert_int_equal(order_field(f, job, "state"), JOB_CANCELLED);
	assert_int_equal(FIELD(f, 3, .class = JOB_INTERACTIVE, .cancel_after_ms = 500), job);
	assert_int_equal(order_claim(f, order_query(), &ticket), job);
	assert_int_equal(order_field(f, job, "class"), JOB_INTERACTIVE);
	assert_int_equal(order_field(f, job, "client"), 3);
	assert_int_equal(order_field(f, job, "cancel_at_ms"), f->now_ms + 500);
	/* A redrive, as it was, but without the deadline that is over. */
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	ok(f, job_release(f->store, &ticket, &f->error));
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	f->now_ms += 1000;
	assert_int_equal(order_next(f), job);
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

/* --- attempts --------------------------------------------------------------------------------------------------- */

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
		FAST_TEST(a_job_does_not_begin_before_its_time),
		FAST_TEST(many_that_are_due_at_once_all_come),
		FAST_TEST(a_deadline_ends_a_queued_and_a_running_job),
		FAST_TEST(retries_are_spread),
		FAST_TEST(a_later_job_with_the_same_word_supersedes),
		FAST_TEST(an_equal_request_makes_a_job_as_urgent_as_it_is),
		FAST_TEST(what_an_urgent_job_needs_is_as_urgent),
		FAST_TEST(what_an_equal_request_needs_becomes_as_urgent_too),
		FAST_TEST(a_job_that_is_to_stop_goes_on_where_it_is_wanted_again),
		FAST_TEST(a_request_for_what_is_there_supersedes_too),
		FAST_TEST(who_hastens_a_job_leaves_it_in_its_group),
		FAST_TEST(an_equal_request_supersedes_what_it_says),
		FAST_TEST(a_job_that_is_asked_for_again_goes_by_the_new_request),
		FAST_TEST(a_worker_prefers_what_it_has_in_memory_for),
		FAST_TEST(no_job_is_passed_over_for_long_because_a_worker_is_warm),
		FAST_TEST(every_attempt_is_remembered_also_after_a_redrive),
		FAST_TEST(a_history_has_an_end),
		FAST_TEST(a_job_that_kills_its_workers_starves_nobody),
		FAST_TEST(a_job_that_is_handed_over_loses_no_attempt_and_no_place),
		FAST_TEST(many_are_cancelled_by_query),
		FAST_TEST(emptied_lanes_hide_nothing),
		cmocka_unit_test(class_and_cancel_names_are_words),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
