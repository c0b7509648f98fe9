/* Jobs that make no resource but a file of one; and jobs that nobody wants any more. */
#include "tests/unit/storage/order.h"

#include "storage/task.h"

static struct job ask_for(struct fixture *f, const char *layout, const char *file, enum job_class class,
			  bool expect_new)
{
	const struct job_request request = {.class = class};
	struct job job;
	bool added = false;
	ok(f, task_ask(f->store, OWNER_DEFAULT, JOB_DRAW, layout, file, &request, &job, &added, &f->error));
	assert_int_equal(added, expect_new);
	job_clear(&job);
	return job;
}

/* A layout that is there: its own job is done. */
static void make_layout(struct fixture *f, char id[STORE_ID_SIZE])
{
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
}

static void finish_file(struct fixture *f, const struct job_ticket *ticket, const char *bytes)
{
	struct job_artifact artifact = {ticket->argument, "image/svg+xml", bytes, strlen(bytes)};
	struct job_result result = {.artifacts = &artifact, .artifact_count = 1};
	ok(f, job_finish(f->store, ticket, &result, &f->error));
}

static bool has_file(struct fixture *f, const char *layout, const char *name)
{
	struct blob blob;
	return blob_find(f->store, layout, BLOB_ARTIFACT, name, &blob, &f->error) == TW_OK;
}

static void a_task_adds_a_file_and_changes_nothing_else(void **state)
{
	struct fixture *f = *state;
	char layout[STORE_ID_SIZE];
	make_layout(f, layout);
	(void)ask_for(f, layout, "pattern.svg", JOB_INTERACTIVE, true);
	struct job_ticket ticket = fixture_claim(f);
	assert_int_equal(ticket.kind, JOB_DRAW);
	assert_string_equal(ticket.subject_id, layout);
	assert_string_equal(ticket.argument, "pattern.svg");
	assert_string_equal(ticket.resource_id, "");
	int64_t before = fixture_ask(f, "SELECT sum(version) + sum(length(summary)) FROM resource");
	finish_file(f, &ticket, "<svg/>");
	assert_true(has_file(f, layout, "pattern.svg"));
	assert_int_equal(fixture_ask(f, "SELECT sum(version) + sum(length(summary)) FROM resource"), before);
	fixture_is_sound(f);
}

static void who_asks_meanwhile_joins_and_may_hasten_it(void **state)
{
	struct fixture *f = *state;
	char layout[STORE_ID_SIZE];
	make_layout(f, layout);
	struct job first = ask_for(f, layout, "pattern.svg", JOB_BATCH, true);
	struct job second = ask_for(f, layout, "pattern.svg", JOB_INTERACTIVE, false);
	assert_string_equal(first.id, second.id);
	assert_int_equal(second.class, JOB_INTERACTIVE);
	(void)ask_for(f, layout, "suit.svg", JOB_INTERACTIVE, true); /* another file, another job */
	struct job_ticket ticket = fixture_claim(f);
	(void)ask_for(f, layout, ticket.argument, JOB_NORMAL, false); /* also while it runs */
}

static void what_has_failed_stays_failed_until_it_is_redriven(void **state)
{
	struct fixture *f = *state;
	struct tw_error failure = {TW_ERROR_INTERNAL, "broken", "", "a bug"};
	char layout[STORE_ID_SIZE];
	make_layout(f, layout);
	struct job job = ask_for(f, layout, "pattern.svg", JOB_NORMAL, true);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	assert_int_equal(ask_for(f, layout, "pattern.svg", JOB_NORMAL, false).state, JOB_FAILED);
	ok(f, job_redrive(f->store, TENANT_DEFAULT, job.id, &f->error));
	ticket = fixture_claim(f);
	finish_file(f, &ticket, "<svg/>");
	assert_true(has_file(f, layout, "pattern.svg"));
}

static void what_was_cancelled_is_asked_for_anew(void **state)
{
	struct fixture *f = *state;
	enum job_state after;
	char layout[STORE_ID_SIZE];
	make_layout(f, layout);
	struct job job = ask_for(f, layout, "pattern.svg", JOB_NORMAL, true);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, job.id, &after, &f->error));
	(void)ask_for(f, layout, "pattern.svg", JOB_NORMAL, true);
}

static void nobody_asks_for_the_layout_of_another(void **state)
{
	struct fixture *f = *state;
	const struct job_request request = {0};
	char layout[STORE_ID_SIZE];
	struct job job;
	bool added = false;
	make_layout(f, layout);
	assert_int_equal(task_ask(f->store, (struct owner){TENANT_DEFAULT + 1, 0}, JOB_DRAW, layout, "pattern.svg",
				  &request, &job, &added, &f->error),
			 TW_ERROR_NOT_FOUND);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE kind = 5"), 0);
}

/* What was read long ago goes first. Fifty at a time. */
static void files_are_dropped_by_when_they_were_read(void **state)
{
	enum { FILES = 60, READ = 5 };
	struct fixture *f = *state;
	char layout[STORE_ID_SIZE], name[32];
	struct blob blob;
	make_layout(f, layout);
	for (int i = 0; i < FILES; i++) {
		snprintf(name, sizeof name, "%d.svg", i);
		(void)ask_for(f, layout, name, JOB_NORMAL, true);
		struct job_ticket ticket = fixture_claim(f);
		finish_file(f, &ticket, "<svg/>");
		f->now_ms += 1000;
	}
	f->now_ms += 2 * 3600 * 1000;
	snprintf(name, sizeof name, "%d.svg", READ);
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, name, &blob, &f->error));
	assert_true(task_is_read_seldom(f->store, &blob));
	ok(f, task_note_read(f->store, &blob, &f->error));
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, name, &blob, &f->error));
	assert_false(task_is_read_seldom(f->store, &blob));

	ok(f, task_drop_files(f->store, 1, &f->error)); /* there is room */
	assert_true(has_file(f, layout, "0.svg"));
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NOT NULL"), FILES - 50);
	assert_true(has_file(f, layout, name));
	assert_false(has_file(f, layout, "0.svg"));
	assert_false(has_file(f, layout, "50.svg")); /* one was spared, so it was this one's turn */
	assert_true(has_file(f, layout, "51.svg"));
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error));
	assert_true(has_file(f, layout, name)); /* somebody may be reading it */
	f->now_ms += 5000;
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error));
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error)); /* and where there is nothing, nothing happens */
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NOT NULL"), 0);
	fixture_sweep(f, 1000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
}

static void a_job_is_let_go_of_only_when_nobody_wants_it(void **state)
{
	struct fixture *f = *state;
	bool cancelled = true;
	struct job job;
	char id[STORE_ID_SIZE];
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_FIELD, .queue = {.transient = true}};
	struct resource field;
	enum resource_outcome outcome;
	for (int i = 0; i < 2; i++) {
		ok(f, resource_create(f->store, &draft, &field, &outcome, &f->error));
		snprintf(id, sizeof id, "%s", field.job.id);
		assert_int_equal(field.job.transient, i + 1);
		resource_clear(&field);
	}
	ok(f, job_cancel_unwanted(f->store, id, 1, &cancelled, &f->error));
	assert_false(cancelled); /* a second request has come since */
	ok(f, job_cancel_unwanted(f->store, id, 0, &cancelled, &f->error));
	assert_false(cancelled);
	draft.queue.transient = false;
	ok(f, resource_create(f->store, &draft, &field, &outcome, &f->error));
	resource_clear(&field);
	for (int requests = 0; requests < 4; requests++) {
		ok(f, job_cancel_unwanted(f->store, id, requests, &cancelled, &f->error));
		assert_false(cancelled); /* somebody wants it for good */
	}

	draft.options = "{\"other\":1}";
	draft.queue.transient = true;
	ok(f, resource_create(f->store, &draft, &field, &outcome, &f->error));
	snprintf(id, sizeof id, "%s", field.job.id);
	resource_clear(&field);
	ok(f, job_cancel_unwanted(f->store, id, 1, &cancelled, &f->error));
	assert_true(cancelled);
	ok(f, job_get(f->store, TENANT_DEFAULT, id, &job, &f->error));
	assert_int_equal(job.state, JOB_CANCELLED);
	assert_int_equal(job.cancel_cause, JOB_CANCEL_UNWANTED);
	job_clear(&job);
	ok(f, job_cancel_unwanted(f->store, id, 1, &cancelled, &f->error));
	assert_false(cancelled); /* it has ended */
}

#define TASK_TEST(name) cmocka_unit_test_setup_teardown(name, fixture_new, fixture_free)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TASK_TEST(a_task_adds_a_file_and_changes_nothing_else),
		TASK_TEST(who_asks_meanwhile_joins_and_may_hasten_it),
		TASK_TEST(what_has_failed_stays_failed_until_it_is_redriven),
		TASK_TEST(what_was_cancelled_is_asked_for_anew),
		TASK_TEST(nobody_asks_for_the_layout_of_another),
		TASK_TEST(files_are_dropped_by_when_they_were_read),
		TASK_TEST(a_job_is_let_go_of_only_when_nobody_wants_it),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
