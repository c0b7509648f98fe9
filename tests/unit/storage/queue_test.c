/* The queue's promises. */
#include "tests/unit/storage/fixture.h"

#include "storage/bulk.h"
#include "storage/job_state.h"
#include "storage/sql.h"

#include <time.h>

static void claim_takes_the_most_urgent_then_the_oldest(void **state)
{
	struct fixture *f = *state;
	char ids[3][STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, ids[0]);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, ids[1]);
	struct resource urgent;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .queue.priority = 5};
	ok(f, resource_create(f->store, &draft, &urgent, &outcome, &f->error));
	struct job_ticket first = fixture_claim(f);
	struct job_ticket second = fixture_claim(f);
	struct job_ticket third = fixture_claim(f);
	assert_string_equal(first.resource_id, urgent.id);
	assert_string_equal(second.resource_id, ids[0]);
	assert_string_equal(third.resource_id, ids[1]);
	resource_clear(&urgent);
}

static void claim_skips_a_leased_job(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fixture_claim(f);
	assert_true(fixture_nothing_to_claim(f));
}

static void claim_takes_only_the_kinds_asked_for(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct job_ticket ticket;
	bool found;
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	ok(f, job_claim(f->store,
			&(struct claim_query){
				.kinds = JOB_KINDS_ALL & ~JOB_KIND_BIT(JOB_RECORD), .worker = "w", .lease_ms = 5000},
			&ticket, &found, &f->error));
	assert_false(found);
	ok(f, job_claim(f->store,
			&(struct claim_query){.kinds = JOB_KIND_BIT(JOB_RECORD), .worker = "rig", .lease_ms = 5000},
			&ticket, &found, &f->error));
	assert_true(found);
	assert_int_equal(ticket.kind, RESOURCE_RECORDING);
}

static void an_expired_lease_goes_to_the_next_worker(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket late = fixture_claim(f);
	f->now_ms += 5000;
	assert_true(fixture_nothing_to_claim(f));
	f->now_ms += 1;
	struct job_ticket next = fixture_claim(f);
	assert_string_equal(next.resource_id, late.resource_id);
	assert_true(next.fence > late.fence);
	assert_int_equal(next.attempt, 2);
}

static void a_heartbeat_keeps_the_lease(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool cancel = true;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	for (int i = 0; i < 4; i++) {
		f->now_ms += 4000;
		ok(f, job_heartbeat(f->store, &ticket, 0.25 * i, "solving", NULL, &cancel, &f->error));
		assert_false(cancel);
		assert_true(fixture_nothing_to_claim(f));
	}
	assert_int_equal(fixture_ask(f, "SELECT progress = 0.75 AND stage = 'solving' FROM job"), 1);
}

/* A worker that was stopped for longer than its lease wakes up and goes on as if nothing had been. */
static void the_fence_refuses_whatever_a_late_worker_writes(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool cancel;
	struct job_artifact artifact = {"a.txt", "text/plain", "late", 4};
	struct job_result result = {.summary = "{\"late\":true}", .artifacts = &artifact, .artifact_count = 1};
	struct tw_error failure = {TW_ERROR_INPUT, "bad", "", "late"};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket late = fixture_claim(f);
	f->now_ms += 5001;
	struct job_ticket next = fixture_claim(f);
	refused(f, job_finish(f->store, &late, &result, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	refused(f, job_fail(f->store, &late, &failure, false, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	refused(f, job_release(f->store, &late, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	refused(f, job_heartbeat(f->store, &late, 0.5, NULL, NULL, &cancel, &f->error), TW_ERROR_CONFLICT,
		"lease-lost");
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	fixture_finish(f, &next);
	refused(f, job_finish(f->store, &next, &result, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	assert_int_equal(fixture_ask(f, "SELECT summary = '{\"done\":true}' FROM resource"), 1);
}

static void a_job_whose_workers_all_die_fails_with_the_reason(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct resource resource;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	for (int i = 0; i < 3; i++) {
		fixture_claim(f);
		f->now_ms += 5001;
	}
	assert_true(fixture_nothing_to_claim(f));
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, id, &resource, &f->error));
	assert_int_equal(resource.job.state, JOB_FAILED);
	assert_string_equal(resource.job.failure.type, "attempts-exhausted");
	ok(f, job_redrive(f->store, TENANT_DEFAULT, resource.job.id, &f->error));
	struct job_ticket again = fixture_claim(f);
	assert_int_equal(again.attempt, 1);
	assert_int_equal(again.fence, 4);
	resource_clear(&resource);
}

static void a_released_job_keeps_its_attempt(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	for (int i = 0; i < 10; i++) {
		struct job_ticket ticket = fixture_claim(f);
		assert_int_equal(ticket.attempt, 1);
		ok(f, job_release(f->store, &ticket, &f->error));
	}
}

static void a_retry_waits_longer_each_time_and_ends(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct tw_error failure = {TW_ERROR_MEMORY, "out-of-memory", "", "no"};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	for (int pause_ms = 1000; pause_ms <= 2000; pause_ms *= 2) {
		struct job_ticket ticket = fixture_claim(f);
		ok(f, job_fail(f->store, &ticket, &failure, true, &f->error));
		f->now_ms += pause_ms - 1;
		assert_true(fixture_nothing_to_claim(f));
		f->now_ms += pause_ms / 2;
	}
	struct job_ticket last = fixture_claim(f);
	ok(f, job_fail(f->store, &last, &failure, true, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_FAILED);
}

/* mesh ← motion ← field ← layout */
static void chain(struct fixture *f, char ids[4][STORE_ID_SIZE])
{
	fixture_create(f, RESOURCE_MESH, "v 0 0 0", NULL, NULL, ids[0]);
	fixture_create(f, RESOURCE_MOTION, "frames", ids[0], NULL, ids[1]);
	fixture_create(f, RESOURCE_FIELD, NULL, ids[1], NULL, ids[2]);
	fixture_create(f, RESOURCE_LAYOUT, NULL, ids[2], NULL, ids[3]);
}

static void a_job_waits_for_what_it_is_made_from(void **state)
{
	struct fixture *f = *state;
	char ids[4][STORE_ID_SIZE];
	chain(f, ids);
	for (int i = 0; i < 4; i++) {
		struct job_ticket ticket = fixture_claim(f);
		assert_string_equal(ticket.resource_id, ids[i]);
		assert_true(fixture_nothing_to_claim(f));
		fixture_finish(f, &ticket);
	}
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 2"), 4);
}

static void a_failure_fails_all_that_waits_and_a_redrive_lifts_it(void **state)
{
	struct fixture *f = *state;
	char ids[4][STORE_ID_SIZE];
	struct tw_error failure = {TW_ERROR_INPUT, "obj-index", "line 7", "the index 9 is out of range"};
	struct resource layout;
	chain(f, ids);
	struct job_ticket mesh = fixture_claim(f);
	ok(f, job_fail(f->store, &mesh, &failure, false, &f->error));
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, ids[3], &layout, &f->error));
	assert_int_equal(layout.job.state, JOB_FAILED);
	assert_string_equal(layout.job.failure.type, "dependency-failed");
	assert_non_null(strstr(layout.job.failure.text, ids[0]));
	assert_non_null(strstr(layout.job.failure.text, "the index 9 is out of range"));
	ok(f, job_redrive(f->store, TENANT_DEFAULT, layout.job.id, &f->error));
	for (int i = 0; i < 4; i++) {
		struct job_ticket ticket = fixture_claim(f);
		assert_string_equal(ticket.resource_id, ids[i]);
		fixture_finish(f, &ticket);
	}
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, ids[3]), JOB_SUCCEEDED);
	resource_clear(&layout);
}

static void a_queued_job_is_cancelled_at_once_and_a_running_one_is_asked(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool cancel = false;
	enum job_state after;
	struct job_ticket ticket;
	struct tw_error stopped = {TW_ERROR_CANCELLED, "cancelled", "", "stopped"};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	ticket = fixture_claim(f);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	assert_int_equal(after, JOB_RUNNING);
	ok(f, job_heartbeat(f->store, &ticket, 0, NULL, NULL, &cancel, &f->error));
	assert_true(cancel);
	ok(f, job_fail(f->store, &ticket, &stopped, false, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, ticket.resource_id), JOB_CANCELLED);
	ticket = fixture_claim(f);
	ok(f, job_release(f->store, &ticket, &f->error));
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	assert_int_equal(after, JOB_CANCELLED);
	assert_true(fixture_nothing_to_claim(f));
	refused(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error), TW_ERROR_CONFLICT,
		"job-finished");
	refused(f, job_cancel(f->store, TENANT_DEFAULT, "job_nothing", &after, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-job");
}

/* The worker died before it could obey. */
/* The job is over before a heartbeat could have told the worker. */
static void a_cancel_that_comes_before_the_end_wins(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE], dependent[STORE_ID_SIZE];
	enum job_state after;
	struct job_artifact artifact = {"layout.json", "application/json", "{}", 2};
	struct job_result result = {.summary = "{}", .artifacts = &artifact, .artifact_count = 1};
	fixture_create(f, RESOURCE_FIELD, NULL, NULL, NULL, id);
	fixture_create(f, RESOURCE_LAYOUT, NULL, id, NULL, dependent);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	assert_int_equal(after, JOB_RUNNING);
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, id), JOB_CANCELLED);
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, dependent), JOB_FAILED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource WHERE summary IS NOT NULL"), 0);
	/* And one that comes after it is too late, and says so. */
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	ticket = fixture_claim(f);
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	refused(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error), TW_ERROR_CONFLICT,
		"job-finished");
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_SUCCEEDED);
}

static void a_cancelled_job_is_not_tried_again(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	enum job_state after;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	f->now_ms += 5001;
	assert_true(fixture_nothing_to_claim(f));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_CANCELLED);
}

static void only_a_failed_or_cancelled_job_is_redriven(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	refused(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error), TW_ERROR_CONFLICT,
		"job-not-failed");
	fixture_finish(f, &ticket);
	refused(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error), TW_ERROR_CONFLICT,
		"job-not-failed");
}

static void every_change_is_seen_once_in_order(void **state)
{
	struct fixture *f = *state;
	char ids[2][STORE_ID_SIZE];
	struct job_page page;
	bool cancel;
	ok(f, job_changes(f->store, -1, 10, &page, &f->error));
	int64_t since = page.next;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, ids[0]);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, ids[1]);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_changes(f->store, since, 10, &page, &f->error));
	assert_int_equal(page.count, 2);
	assert_string_equal(page.jobs[0].resource_id, ids[1]);
	assert_int_equal(page.jobs[0].state, JOB_QUEUED);
	assert_string_equal(page.jobs[1].resource_id, ids[0]);
	assert_int_equal(page.jobs[1].state, JOB_RUNNING);
	since = page.next;
	job_page_clear(&page);
	ok(f, job_heartbeat(f->store, &ticket, 0, "", NULL, &cancel, &f->error));
	ok(f, job_changes(f->store, since, 10, &page, &f->error));
	assert_int_equal(page.count, 0);
	assert_int_equal(page.next, since);
	job_page_clear(&page);
	ok(f, job_heartbeat(f->store, &ticket, 0.5, "solving", "{\"gap\":0.1}", &cancel, &f->error));
	ok(f, job_changes(f->store, since, 10, &page, &f->error));
	assert_int_equal(page.count, 1);
	assert_string_equal(page.jobs[0].partial, "{\"gap\":0.1}");
	job_page_clear(&page);
}

/* A change number must never come back, also when the job with the highest was deleted. */
static void deleting_a_job_does_not_hide_later_changes(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct job_page page;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	ok(f, job_changes(f->store, -1, 10, &page, &f->error));
	int64_t since = page.next;
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, id, false, &f->error));
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	ok(f, job_changes(f->store, since, 10, &page, &f->error));
	assert_int_equal(page.count, 1);
	job_page_clear(&page);
}

static void results_come_back_as_they_were_written(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	size_t rows = 300000;
	double *values = malloc(rows * 2 * sizeof *values);
	double *back = malloc(rows * 2 * sizeof *values);
	for (size_t i = 0; i < rows * 2; i++)
		values[i] = (double)i / 7;
	struct tw_array arrays[] = {{"density", TW_F64, 2, rows, values}, {"empty", TW_U32, 3, 0, NULL}};
	struct job_artifact artifacts[] = {{"pattern.svg", "image/svg+xml", "<svg/>", 6}};
	struct job_result result = {.summary = "{\"n\":1}",
				    .arrays = arrays,
				    .array_count = 2,
				    .artifacts = artifacts,
				    .artifact_count = 1};
	fixture_create(f, RESOURCE_FIELD, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_finish(f->store, &ticket, &result, &f->error));

	struct blob blob;
	size_t got;
	ok(f, blob_find(f->store, id, BLOB_ARRAY, "density", &blob, &f->error));
	assert_int_equal(blob.type, TW_F64);
	assert_int_equal(blob.columns, 2);
	assert_int_equal(blob.rows, rows);
	ok(f, blob_read(f->store, blob.number, 0, back, rows * 16, &got, &f->error));
	assert_int_equal(got, rows * 16);
	assert_memory_equal(back, values, got);
	ok(f, blob_find(f->store, id, BLOB_ARRAY, "empty", &blob, &f->error));
	ok(f, blob_read(f->store, blob.number, 0, back, 16, &got, &f->error));
	assert_int_equal(got, 0);
	ok(f, blob_find(f->store, id, BLOB_ARTIFACT, "pattern.svg", &blob, &f->error));
	assert_string_equal(blob.media_type, "image/svg+xml");
	assert_int_equal(
		fixture_ask(f, "SELECT bytes = CAST('<svg/>' AS BLOB) FROM chunk ORDER BY number DESC LIMIT 1"), 1);
	refused(f, blob_find(f->store, id, BLOB_ARTIFACT, "none", &blob, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-blob");
	free(values);
	free(back);
}

static void fail_all(struct fixture *f, const char *type)
{
	struct tw_error failure = {TW_ERROR_FULL, type, "", "no room"};
	while (fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0 AND waiting_for = 0")) {
		struct job_ticket ticket = fixture_claim(f);
		ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	}
}

static uint64_t redrive_all(struct fixture *f, const struct job_query *query)
{
	struct bulk_progress progress = {0};
	for (int steps = 0; !progress.done; steps++) {
		assert_true(steps < 100);
		ok(f, bulk_step(f->store, BULK_REDRIVE, query, &progress, &f->error));
	}
	return progress.changed;
}

static void many_are_redriven_by_query_in_steps(void **state)
{
	struct fixture *f = *state;
	char field[STORE_ID_SIZE], id[STORE_ID_SIZE];
	enum job_state after;
	for (int i = 0; i < 120; i++)
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fail_all(f, "store-full");
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fail_all(f, "no-such-vertex");
	fixture_create(f, RESOURCE_FIELD, NULL, NULL, NULL, field);
	fixture_create(f, RESOURCE_LAYOUT, NULL, field, NULL, id);
	fail_all(f, "store-full");
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	struct job_page page;
	ok(f, job_list(f->store, &(struct job_query){.tenant = TENANT_DEFAULT, .states = 1u << JOB_QUEUED, .limit = 1},
		       &page, &f->error));
	ok(f, job_cancel(f->store, TENANT_DEFAULT, page.jobs[0].id, &after, &f->error));
	job_page_clear(&page);

	/* Listed by problem, in pages, newest first, and by kind and state besides. */
	struct job_query listed = {.tenant = TENANT_DEFAULT, .failure_type = "store-full", .limit = 100};
	size_t found = 0;
	do {
		ok(f, job_list(f->store, &listed, &page, &f->error));
		for (size_t i = 0; i < page.count; i++)
			assert_string_equal(page.jobs[i].failure.type, "store-full");
		found += page.count;
		listed.cursor = page.next;
		job_page_clear(&page);
	} while (listed.cursor);
	assert_int_equal(found, 121);
	listed.kinds = JOB_KIND_BIT(JOB_COMPUTE_FIELD);
	ok(f, job_list(f->store, &listed, &page, &f->error));
	assert_int_equal(page.count, 1);
	job_page_clear(&page);
	listed.states = 1u << JOB_CANCELLED;
	ok(f, job_list(f->store, &listed, &page, &f->error));
	assert_int_equal(page.count, 0);
	job_page_clear(&page);

	/* By problem and kind: the field stays. */
	struct job_query full = {.tenant = TENANT_DEFAULT,
				 .states = 1u << JOB_FAILED,
				 .failure_type = "store-full",
				 .kinds = JOB_KIND_BIT(JOB_COMPUTE_LAYOUT)};
	struct bulk_progress progress = {0};
	ok(f, bulk_step(f->store, BULK_REDRIVE, &full, &progress, &f->error));
	assert_false(progress.done);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0"), progress.changed);
	assert_in_range(progress.changed, 1, 100);
	assert_int_equal(progress.changed + redrive_all(f, &full), 120);
	assert_int_equal(redrive_all(f, &full), 0);
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, field), JOB_FAILED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0 AND attempts = 0"
					" AND failure_type = ''"),
			 120);

	/* The layout needs the field, which goes back with it, but was not asked for. */
	struct job_query dependents = {
		.tenant = TENANT_DEFAULT, .states = 1u << JOB_FAILED, .failure_type = "dependency-failed"};
	assert_int_equal(redrive_all(f, &dependents), 1);
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, field), JOB_QUEUED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0 AND waiting_for = 1"), 1);

	/* All that is left. */
	assert_int_equal(redrive_all(f, &(struct job_query){.tenant = TENANT_DEFAULT, .states = 1u << JOB_FAILED}), 1);
	assert_int_equal(redrive_all(f, &(struct job_query){.tenant = TENANT_DEFAULT, .states = 1u << JOB_CANCELLED}),
			 1);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state <> 0"), 0);
}

/* A job that fails again as fast as it is redriven does not keep the request for ever. */
static void a_job_is_redriven_once_by_a_query(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	for (int i = 0; i < 60; i++)
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fail_all(f, "store-full");
	struct job_query query = {.tenant = TENANT_DEFAULT, .states = 1u << JOB_FAILED};
	struct bulk_progress progress = {0};
	for (int steps = 0; !progress.done; steps++) {
		assert_true(steps < 10);
		ok(f, bulk_step(f->store, BULK_REDRIVE, &query, &progress, &f->error));
		fail_all(f, "store-full");
	}
	assert_int_equal(progress.changed, 60);
}

static void jobs_are_counted_by_state(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct job_counts counts;
	for (int i = 0; i < 3; i++)
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
	fixture_claim(f);
	f->now_ms += 700;
	ok(f, job_count(f->store, &counts, &f->error));
	assert_int_equal(counts.by_state[JOB_QUEUED], 1);
	assert_int_equal(counts.by_state[JOB_RUNNING], 1);
	assert_int_equal(counts.by_state[JOB_SUCCEEDED], 1);
	assert_int_equal(counts.oldest_ms, 700);
}

static void an_incomplete_result_is_kept(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	struct job_result result = {.summary = "{\"gaps\":7}", .incomplete = true};
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	struct resource resource;
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_RECORDING, id, &resource, &f->error));
	assert_int_equal(resource.job.state, JOB_INCOMPLETE);
	assert_true(job_state_is_final(resource.job.state));
	assert_string_equal(resource.summary, "{\"gaps\":7}");
	resource_clear(&resource);
	refused(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error), TW_ERROR_CONFLICT,
		"job-not-failed");
	enum job_state after;
	refused(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error), TW_ERROR_CONFLICT,
		"job-finished");
}

static void what_needs_an_incomplete_result_fails(void **state)
{
	struct fixture *f = *state;
	char field[STORE_ID_SIZE], layout[STORE_ID_SIZE];
	struct resource resource, refused_one;
	enum resource_outcome outcome;
	fixture_create(f, RESOURCE_FIELD, NULL, NULL, NULL, field);
	fixture_create(f, RESOURCE_LAYOUT, NULL, field, NULL, layout);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_finish(f->store, &ticket, &(struct job_result){.incomplete = true}, &f->error));
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, layout, &resource, &f->error));
	assert_int_equal(resource.job.state, JOB_FAILED);
	assert_string_equal(resource.job.failure.type, "dependency-failed");
	assert_non_null(strstr(resource.job.failure.text, "is incomplete"));
	resource_clear(&resource);
	const struct resource_draft draft = {.owner = OWNER_DEFAULT,
					     .kind = RESOURCE_LAYOUT,
					     .needs = (const char *const[]){field},
					     .need_count = 1};
	refused(f, resource_create(f->store, &draft, &refused_one, &outcome, &f->error), TW_ERROR_CONFLICT,
		"dependency-failed");
}

/* A webhook's delivery, say, or a rendering. */
static void a_job_without_a_resource_runs_like_any_other(void **state)
{
	struct fixture *f = *state;
	struct job job;
	int64_t number = 0;
	const struct job_request request = {.attempts_max = 2};
	ok(f, transaction_begin(f->store, true, &f->error));
	ok(f, job_state_add(f->store, OWNER_DEFAULT, 0, JOB_COMPUTE_LAYOUT, &request, &number, &f->error));
	ok(f, transaction_end(f->store, TW_OK, &f->error));
	struct tw_error failure = {TW_ERROR_INPUT, "no-such-thing", "", "nothing"};
	struct job_ticket ticket = fixture_claim(f);
	assert_string_equal(ticket.resource_id, "");
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
	ok(f, job_get(f->store, TENANT_DEFAULT, ticket.job_id, &job, &f->error));
	assert_int_equal(job.state, JOB_SUCCEEDED);
	assert_string_equal(job.resource_id, "");
	job_clear(&job);
	struct job_page page;
	struct job_query query = {.tenant = TENANT_DEFAULT, .limit = 10};
	ok(f, job_list(f->store, &query, &page, &f->error));
	assert_int_equal(page.count, 1);
	job_page_clear(&page);
}

/* A newer release works on the same store, and has a kind of job more. */
static void a_job_of_an_unknown_kind_is_shown_and_left_alone(void **state)
{
	struct fixture *f = *state;
	struct job_page page;
	struct job job;
	assert_int_equal(
		sqlite3_exec(f->oracle,
			     "INSERT INTO share(number, tenant, client, pool, class, open) VALUES (1, 1, 0, 0, 2, 1);"
			     "INSERT INTO turn VALUES (0, 2, 0, 1);"
			     "INSERT INTO lane(number, share, kind, head_number) VALUES (1, 1, 77, 1);"
			     "INSERT INTO job(id, kind, attempts_max, created_ms, lane)"
			     " VALUES ('job_new', 77, 3, 5, 1)",
			     NULL, NULL, NULL),
		SQLITE_OK);
	assert_true(fixture_nothing_to_claim(f));
	ok(f, job_list(f->store, &(struct job_query){.tenant = TENANT_DEFAULT, .limit = 10}, &page, &f->error));
	assert_int_equal(page.count, 1);
	assert_string_equal(job_kind_name(page.jobs[0].kind), "unknown");
	assert_int_equal(job_kind_row(page.jobs[0].kind)->resource, RESOURCE_NONE);
	job_page_clear(&page);
	ok(f, job_get(f->store, TENANT_DEFAULT, "job_new", &job, &f->error));
	assert_int_equal(job.state, JOB_QUEUED);
	job_clear(&job);
	enum job_state after;
	ok(f, job_cancel(f->store, TENANT_DEFAULT, "job_new", &after, &f->error));
	assert_int_equal(after, JOB_CANCELLED);
}

static double cpu_seconds(void)
{
	return (double)clock() / CLOCKS_PER_SEC;
}

/* A night's batch: what a step costs must not grow with what is queued. */
static void a_long_queue_costs_no_more(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	double seconds[2];
	for (int round = 0; round < 2; round++) {
		double start = cpu_seconds();
		for (int i = 0; i < 50; i++) {
			fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
			struct job_ticket ticket = fixture_claim(f);
			fixture_finish(f, &ticket);
		}
		seconds[round] = cpu_seconds() - start;
		assert_int_equal(
			sqlite3_exec(
				f->oracle,
				"WITH RECURSIVE n(i) AS (VALUES (1000) UNION ALL SELECT i + 1 FROM n WHERE i < 30000)"
				" INSERT INTO resource(number, id, kind, name, options, created_ms)"
				" SELECT i, 'layout_' || i, 3, '', '{}', 1 FROM n WHERE NOT EXISTS"
				" (SELECT 1 FROM resource WHERE number = 1000);"
				"INSERT INTO job(id, resource, kind, attempts_max, created_ms, lane, change)"
				" SELECT 'job_' || number, number, 3, 3, 1, (SELECT number FROM lane WHERE kind = 3),"
				" -number FROM resource WHERE number >= 1000"
				" AND NOT EXISTS (SELECT 1 FROM job WHERE resource = resource.number)",
				NULL, NULL, NULL),
			SQLITE_OK);
	}
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 0"), 29001);
	assert_true(seconds[1] < 3 * seconds[0] + 0.1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(claim_takes_the_most_urgent_then_the_oldest),
		TEST(claim_skips_a_leased_job),
		TEST(claim_takes_only_the_kinds_asked_for),
		TEST(an_expired_lease_goes_to_the_next_worker),
		TEST(a_heartbeat_keeps_the_lease),
		TEST(the_fence_refuses_whatever_a_late_worker_writes),
		TEST(a_job_whose_workers_all_die_fails_with_the_reason),
		TEST(a_released_job_keeps_its_attempt),
		TEST(a_retry_waits_longer_each_time_and_ends),
		TEST(a_job_waits_for_what_it_is_made_from),
		TEST(a_failure_fails_all_that_waits_and_a_redrive_lifts_it),
		TEST(a_queued_job_is_cancelled_at_once_and_a_running_one_is_asked),
		TEST(a_cancel_that_comes_before_the_end_wins),
		TEST(a_cancelled_job_is_not_tried_again),
		TEST(only_a_failed_or_cancelled_job_is_redriven),
		TEST(every_change_is_seen_once_in_order),
		TEST(deleting_a_job_does_not_hide_later_changes),
		TEST(results_come_back_as_they_were_written),
		TEST(many_are_redriven_by_query_in_steps),
		TEST(a_job_is_redriven_once_by_a_query),
		TEST(jobs_are_counted_by_state),
		TEST(an_incomplete_result_is_kept),
		TEST(what_needs_an_incomplete_result_fails),
		TEST(a_job_without_a_resource_runs_like_any_other),
		TEST(a_job_of_an_unknown_kind_is_shown_and_left_alone),
		TEST(a_long_queue_costs_no_more),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
