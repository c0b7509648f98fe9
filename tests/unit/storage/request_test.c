/* What a request says of its job but its turn: not before, no longer than, in place of which; and what two requests for
 * the same come to. */
#include "tests/unit/storage/order.h"

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

int main(void)
{
	const struct CMUnitTest tests[] = {
		FAST_TEST(a_job_does_not_begin_before_its_time),
		FAST_TEST(many_that_are_due_at_once_all_come),
		FAST_TEST(a_deadline_ends_a_queued_and_a_running_job),
		FAST_TEST(a_later_job_with_the_same_word_supersedes),
		FAST_TEST(an_equal_request_makes_a_job_as_urgent_as_it_is),
		FAST_TEST(what_an_urgent_job_needs_is_as_urgent),
		FAST_TEST(what_an_equal_request_needs_becomes_as_urgent_too),
		FAST_TEST(a_job_that_is_to_stop_goes_on_where_it_is_wanted_again),
		FAST_TEST(a_request_for_what_is_there_supersedes_too),
		FAST_TEST(who_hastens_a_job_leaves_it_in_its_group),
		FAST_TEST(an_equal_request_supersedes_what_it_says),
		FAST_TEST(a_job_that_is_asked_for_again_goes_by_the_new_request),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
