/* However many rows there are, no statement walks a table: SQLite is asked how it would run every one of them. */
#include "tests/unit/storage/order.h"

#include "storage/access.h"
#include "storage/attempt.h"
#include "storage/bulk.h"
#include "storage/recording.h"
#include "storage/sql.h"
#include "storage/task.h"

/* What may be walked: tables of one row or a handful, what a statement has put together itself, and the running jobs,
 * which are as many as there are workers. */
static bool may_be_walked(const char *name)
{
	static const char *const known[] = {"up",
					    "down",
					    "d",
					    "cause",
					    "c",
					    "change",
					    "rig",
					    "boot",
					    "access",
					    "secret", /* every daemon keeps all keys in memory */
					    "job_count",
					    "CONSTANT",
					    "f",
					    "(subquery",
					    "job USING INDEX job_leased",
					    "blob USING INDEX blob_of_task" /* its first row */};
	for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
		size_t size = strlen(known[i]);
		if (!strncmp(name, known[i], size) && (name[size] == '\0' || name[size] == ' ' || name[size] == '-'))
			return true;
	}
	return false;
}

static unsigned check_plan(struct fixture *f, const char *text)
{
	char explain[4096];
	sqlite3_stmt *statement = NULL;
	unsigned faults = 0;
	if (!strncmp(text, "PRAGMA", 6) || !strncmp(text, "BEGIN", 5))
		return 0;
	assert_in_range(snprintf(explain, sizeof explain, "EXPLAIN QUERY PLAN %s", text), 1, sizeof explain - 1);
	assert_int_equal(sqlite3_prepare_v2(f->oracle, explain, -1, &statement, NULL), SQLITE_OK);
	while (sqlite3_step(statement) == SQLITE_ROW) {
		const char *line = (const char *)sqlite3_column_text(statement, 3);
		/* The turns of open shares, once, at the end of a tenant. */
		bool ends_tenant = strstr(text, "DELETE FROM turn WHERE share IN") != NULL;
		bool walks = !strncmp(line, "SCAN ", 5) && !may_be_walked(line + 5) && !ends_tenant;
		/* The blobs of one resource are few. */
		bool sorts = !strncmp(line, "USE TEMP B-TREE", 15) && !strstr(text, "FROM blob b JOIN resource r");
		if (walks || sorts)
			print_error("%s\n   in %s\n", line, text);
		faults += walks || sorts;
	}
	sqlite3_finalize(statement);
	return faults;
}

static unsigned check_connection(struct fixture *f, const struct connection *connection)
{
	unsigned faults = 0;
	for (int i = 0; i < connection->statement_count; i++)
		faults += check_plan(f, connection->statements[i].text);
	return faults;
}

static void list_everything(struct fixture *f, const char *mesh)
{
	static const unsigned states[] = {0, 1u << JOB_QUEUED, 1u << JOB_FAILED | 1u << JOB_CANCELLED};
	for (size_t i = 0; i < sizeof states / sizeof *states; i++) {
		struct job_page jobs;
		struct resource_page resources;
		struct job_query job_query = {.tenant = TENANT_DEFAULT,
					      .kinds = i ? JOB_KIND_BIT(JOB_RECORD) : 0,
					      .states = states[i],
					      .limit = 3};
		struct resource_query query = {
			.tenant = TENANT_DEFAULT, .kind = RESOURCE_MOTION, .states = states[i], .limit = 3};
		ok(f, job_list(f->store, &job_query, &jobs, &f->error));
		job_page_clear(&jobs);
		job_query.failure_type = "wrong";
		ok(f, job_list(f->store, &job_query, &jobs, &f->error));
		job_page_clear(&jobs);
		ok(f, resource_list(f->store, &query, &resources, &f->error));
		resource_page_clear(&resources);
		query.needs = mesh;
		ok(f, resource_list(f->store, &query, &resources, &f->error));
		resource_page_clear(&resources);
	}
}

static void read_everything(struct fixture *f, const char *mesh, const char *job_id)
{
	struct job_page page;
	struct job_counts counts;
	struct job job;
	struct blob blob, *blobs;
	struct rig_state rig;
	char(*ids)[STORE_ID_SIZE], byte;
	size_t count, got;
	ok(f, job_changes(f->store, 0, 3, &page, &f->error));
	job_page_clear(&page);
	ok(f, job_changes(f->store, -1, 3, &page, &f->error));
	ok(f, job_count(f->store, &counts, &f->error));
	ok(f, job_get(f->store, TENANT_DEFAULT, job_id, &job, &f->error));
	job_clear(&job);
	ok(f, resource_needs(f->store, mesh, RESOURCE_MESH, &ids, &count, &f->error));
	free(ids);
	ok(f, blob_find(f->store, mesh, BLOB_UPLOAD, "worn", &blob, &f->error));
	ok(f, blob_read(f->store, blob.number, 0, &byte, 1, &got, &f->error));
	ok(f, blob_list(f->store, mesh, BLOB_UPLOAD, &blobs, &count, &f->error));
	free(blobs);
	ok(f, rig_get(f->store, &rig, &f->error));
	ok(f, store_ping(f->store, &f->error));
}

static void record(struct fixture *f)
{
	char id[STORE_ID_SIZE];
	struct rig_sample samples[3] = {{.at_us = 1}, {.at_us = 2}, {.at_us = 3}};
	struct recording_extent extent;
	struct recording_course course = {0};
	struct rig_state rig = {.device = "tcp://x"};
	size_t got;
	bool cancel, found;
	struct job_ticket ticket;
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	ok(f, rig_put(f->store, &rig, &f->error));
	ok(f, job_claim(f->store,
			&(struct claim_query){.kinds = JOB_KIND_BIT(JOB_RECORD), .worker = "rig", .lease_ms = 5000},
			&ticket, &found, &f->error));
	assert_true(found);
	bool resumed;
	ok(f, recording_begin(f->store, &ticket, &course, &resumed, &f->error));
	char begun[3][STORE_ID_SIZE];
	ok(f, recording_list_begun(f->store, begun, 3, &got, &f->error));
	ok(f, recording_find_course(f->store, id, &course, &found, &f->error));
	ok(f, recording_append(f->store, &ticket, samples, 3, &course, 0.5, &cancel, &f->error));
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	ok(f, recording_read(f->store, id, 1, samples, 3, &got, &f->error));
	fixture_finish(f, &ticket);
}

/* Every way of a job. */
static void work_on_everything(struct fixture *f, const char *mesh, const char *motion)
{
	char layout[STORE_ID_SIZE];
	bool cancel;
	enum job_state state;
	struct tw_error failure = {TW_ERROR_INPUT, "wrong", "", "wrong"};
	struct tw_array array = {"position", TW_F64, 1, 1, &(double){1}};
	struct job_artifact artifact = {"a.svg", "image/svg+xml", "x", 1};
	struct job_result result = {.summary = "{}",
				    .arrays = &array,
				    .array_count = 1,
				    .artifacts = &artifact,
				    .artifact_count = 1,
				    .dropped_part = "pattern"};
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_heartbeat(f->store, &ticket, 0.5, "s", "{}", &cancel, &f->error));
	ok(f, job_release(f->store, &ticket, &f->error));
	ticket = fixture_claim(f);
	ok(f, job_put_off(f->store, &ticket, 1, &f->error));
	f->now_ms += 2000;
	ticket = fixture_claim(f);
	ok(f, job_abandon(f->store, "tester", true, &f->error));
	fixture_claim(f);
	f->now_ms += 6000;
	ticket = fixture_claim(f);
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	ticket = fixture_claim(f);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &state, &f->error));
	struct job_query redrive = {.tenant = TENANT_DEFAULT, .states = 1u << JOB_CANCELLED};
	struct bulk_progress progress = {0};
	ok(f, bulk_step(f->store, BULK_REDRIVE, &redrive, &progress, &f->error));
	assert_int_equal(progress.changed, 1);
	redrive.failure_type = "wrong";
	progress = (struct bulk_progress){0};
	ok(f, bulk_step(f->store, BULK_REDRIVE, &redrive, &progress, &f->error));
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &state, &f->error));
	read_everything(f, mesh, ticket.job_id);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, "{}", layout);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, layout, false, &f->error));
	list_everything(f, mesh);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MOTION, motion, true, &f->error));
	fixture_sweep(f, 0);
	ok(f, store_shrink(f->store, &f->error));
}

/* Every way of the queue. */
static void queue_everything(struct fixture *f)
{
	struct job_ticket ticket;
	struct claim_query query = order_query();
	struct attempt *attempts = NULL;
	struct bulk_progress progress = {0};
	struct tw_error failure = {TW_ERROR_INPUT, "wrong", "", "wrong"};
	const struct job_query batches = {.tenant = TENANT_DEFAULT, .group = "night", .classes = 1u << JOB_BATCH};
	int64_t warm = job_affinity("field_1", "drag"), wait_ms = 0;
	size_t count = 0;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE];
	query.affinities = &warm;
	query.affinity_count = 1;
	ORDER(f, 1, .group = "night", .class = JOB_BATCH, .supersedes = "a", .weight = 2);
	ORDER(f, 1, .group = "night", .class = JOB_BATCH, .supersedes = "a", .max_running = 2);
	ORDER(f, 2, .not_before_ms = f->now_ms + 100, .cancel_after_ms = 5000, .class = JOB_BATCH);
	ORDER(f, 2, .priority = 1, .group = "day");
	ORDER(f, 2, .affinity = 5);
	ORDER(f, 2, .affinity = warm);
	f->now_ms += 100;
	while (order_claim(f, query, &ticket))
		ok(f, job_put_off(f->store, &ticket, 0, &f->error));
	f->now_ms += 4900;
	ok(f, job_next_due(f->store, &wait_ms, &f->error));
	ok(f, job_expire(f->store, &f->error));
	assert_true(order_claim(f, query, &ticket));
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	ok(f, attempt_list(f->store, ticket.job_id, &attempts, &count, &f->error));
	free(attempts);
	while (!progress.done)
		ok(f, bulk_step(f->store, BULK_CANCEL, &batches, &progress, &f->error));
	fixture_create(f, RESOURCE_MESH, "v 7 7 7", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_MOTION, "seven", mesh, NULL, motion);
	fixture_create(f, RESOURCE_MOTION, "seven", mesh, NULL, motion);
	while (order_claim(f, query, &ticket))
		fixture_finish(f, &ticket);
	order_of_kind(f, RESOURCE_FIELD, 1, (struct job_request){.class = JOB_BATCH});
	order_of_kind(f, RESOURCE_FIELD, 2, (struct job_request){.class = JOB_INTERACTIVE});
	assert_true(order_claim(f, query, &ticket));
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_FIELD, ticket.resource_id, true, &f->error));
}

/* And of the jobs that make no resource. */
static void draw_everything(struct fixture *f)
{
	char layout[STORE_ID_SIZE];
	const struct job_request request = {.class = JOB_INTERACTIVE, .transient = true};
	struct job_artifact artifact = {"pattern.svg", "image/svg+xml", "<svg/>", 6};
	struct job_result result = {.artifacts = &artifact, .artifact_count = 1};
	struct claim_query query = order_query();
	struct job_ticket ticket;
	struct job job;
	struct blob blob;
	bool added = false, cancelled = false;
	query.kinds = JOB_KIND_BIT(JOB_DRAW);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, layout);
	for (int i = 0; i < 2; i++) {
		ok(f, task_ask(f->store, OWNER_DEFAULT, JOB_DRAW, layout, "pattern.svg", &request, &job, &added,
			       &f->error));
		job_clear(&job);
	}
	assert_true(order_claim(f, query, &ticket));
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, "pattern.svg", &blob, &f->error));
	ok(f, task_note_read(f->store, &blob, &f->error));
	f->now_ms += 5000;
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error));
	ok(f, task_ask(f->store, OWNER_DEFAULT, JOB_DRAW, layout, "pattern.svg", &request, &job, &added, &f->error));
	ok(f, job_cancel_unwanted(f->store, job.id, job.transient, &cancelled, &f->error));
	assert_true(cancelled);
	job_clear(&job);
}

static void keys_and_a_tenant_that_goes(struct fixture *f)
{
	char secret[SECRET_SIZE];
	int64_t mill = 0, change = 0;
	bool more = true;
	struct key key;
	struct key_page page;
	struct access access;
	struct tenant tenants[4];
	struct resource layout;
	enum resource_outcome outcome;
	size_t count = 0;
	ok(f, tenant_create(f->store, "mill", &mill, &f->error));
	const struct key_draft draft = {
		.tenant = mill, .name = "mes", .scopes = KEY_READ, .limits = {.queued_jobs = 5}};
	ok(f, key_create(f->store, &draft, &key, secret, &f->error));
	ok(f, key_find(f->store, mill, "mes", &key, &f->error));
	ok(f, key_get_number(f->store, key.number, &key, &f->error));
	ok(f, key_rotate(f->store, mill, key.id, 1000, &key, secret, &f->error));
	ok(f, key_list(f->store, mill, 0, 10, &page, &f->error));
	key_page_clear(&page);
	ok(f, access_change(f->store, &change, &f->error));
	ok(f, access_read(f->store, &access, &f->error));
	access_clear(&access);
	ok(f, access_add_uses(f->store, &(struct access_use){key.number, 1, 1}, 1, &f->error));
	const struct resource_draft asked = {.owner = {mill, key.number}, .kind = RESOURCE_LAYOUT};
	ok(f, resource_create(f->store, &asked, &layout, &outcome, &f->error));
	resource_clear(&layout);
	ok(f, key_revoke(f->store, mill, key.id, &key, &f->error));
	ok(f, tenant_list(f->store, 0, tenants, 4, &count, &f->error));
	ok(f, tenant_delete(f->store, "mill", &f->error));
	while (more)
		ok(f, tenant_sweep(f->store, &more, &f->error));
}

static void no_statement_walks_a_table(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE], upload[STORE_ID_SIZE], id[STORE_ID_SIZE];
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft keyed = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .idempotency_key = "k"};
	fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, NULL, id);
	fixture_create(f, RESOURCE_MOTION, "frames", mesh, NULL, motion);
	fixture_upload(f, "worn", "a.obj", "forgotten", upload);
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload, &f->error));
	ok(f, resource_create(f->store, &keyed, &resource, &outcome, &f->error));
	resource_clear(&resource);
	work_on_everything(f, mesh, motion);
	record(f);
	queue_everything(f);
	draw_everything(f);
	keys_and_a_tenant_that_goes(f);
	assert_int_equal(check_connection(f, &f->store->reads), 0);
	ok(f, transaction_begin(f->store, false, &f->error));
	const struct connection *writer = f->store->connection;
	ok(f, transaction_end(f->store, TW_OK, &f->error));
	assert_true(f->store->reads.statement_count + writer->statement_count > 100);
	assert_int_equal(check_connection(f, writer), 0);
}

static void the_counts_are_those_of_counting(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE], id[STORE_ID_SIZE];
	struct job_counts counts;
	struct tw_error failure = {TW_ERROR_INPUT, "wrong", "", "wrong"};
	for (int i = 0; i < 3; i++) {
		char content[16];
		snprintf(content, sizeof content, "v %d", i);
		fixture_create(f, RESOURCE_MESH, content, NULL, NULL, mesh);
		fixture_create(f, RESOURCE_MOTION, content, mesh, NULL, motion);
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	}
	struct job_ticket ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
	ticket = fixture_claim(f);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error)); /* with the motion that needs it */
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, true, &f->error));
	fixture_claim(f);
	ok(f, job_count(f->store, &counts, &f->error));
	for (enum job_state s = 0; s < JOB_STATES; s++) {
		char question[96];
		snprintf(question, sizeof question, "SELECT count(*) FROM job WHERE state = %d", (int)s);
		assert_int_equal(counts.by_state[s], fixture_ask(f, question));
	}
	assert_int_equal(fixture_ask(f,
				     "SELECT count(*) FROM (SELECT kind, state, count(*) FROM job GROUP BY kind, state"
				     " EXCEPT SELECT kind, state, count FROM job_count)"),
			 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(no_statement_walks_a_table),
		TEST(the_counts_are_those_of_counting),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
