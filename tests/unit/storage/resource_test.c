/* Resources: addressed by content, created once, listed in stable pages, removed whole. */
#include "tests/unit/storage/fixture.h"

static void equal_uploads_are_one_mesh(void **state)
{
	struct fixture *f = *state;
	char first[STORE_ID_SIZE], second[STORE_ID_SIZE], other[STORE_ID_SIZE];
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, NULL, first), RESOURCE_CREATED);
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, NULL, second), RESOURCE_EXISTED);
	assert_string_equal(first, second);
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v 1 2 4", NULL, NULL, other), RESOURCE_CREATED);
	assert_string_not_equal(first, other);
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, "{\"unit\":\"cm\"}", other),
			 RESOURCE_CREATED);
	assert_string_not_equal(first, other);
	fixture_sweep(f, 5000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 3);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job"), 3);
}

/* What stands in one field of the address must not be able to pass for another. */
static void the_address_keeps_its_fields_apart(void **state)
{
	struct fixture *f = *state;
	struct resource a, b;
	enum resource_outcome outcome;
	struct resource_draft first = {.owner = OWNER_DEFAULT, .kind = RESOURCE_MOTION, .name = "ab", .options = "c"};
	struct resource_draft second = {.owner = OWNER_DEFAULT, .kind = RESOURCE_MOTION, .name = "a", .options = "bc"};
	ok(f, resource_create(f->store, &first, &a, &outcome, &f->error));
	ok(f, resource_create(f->store, &second, &b, &outcome, &f->error));
	assert_string_not_equal(a.id, b.id);
	resource_clear(&a);
	resource_clear(&b);
}

static void a_failed_mesh_is_tried_again_when_it_comes_again(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct tw_error failure = {TW_ERROR_INPUT, "obj-index", "line 7", "bad"};
	fixture_create(f, RESOURCE_MESH, "v", NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v", NULL, NULL, id), RESOURCE_RETRIED);
	ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
	assert_int_equal(fixture_create(f, RESOURCE_MESH, "v", NULL, NULL, id), RESOURCE_EXISTED);
	assert_int_equal(fixture_state(f, RESOURCE_MESH, id), JOB_SUCCEEDED);
}

static void an_idempotency_key_makes_asking_twice_safe(void **state)
{
	struct fixture *f = *state;
	struct resource a, b;
	enum resource_outcome outcome;
	struct resource_draft draft = {
		.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .options = "{\"n\":1}", .idempotency_key = "order-7"};
	ok(f, resource_create(f->store, &draft, &a, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_CREATED);
	ok(f, resource_create(f->store, &draft, &b, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_EXISTED);
	assert_string_equal(a.id, b.id);
	resource_clear(&b);
	draft.options = "{\"n\":2}";
	refused(f, resource_create(f->store, &draft, &b, &outcome, &f->error), TW_ERROR_CONFLICT,
		"idempotency-key-reused");
	draft.idempotency_key = NULL;
	ok(f, resource_create(f->store, &draft, &b, &outcome, &f->error));
	assert_string_not_equal(a.id, b.id);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job"), 2);
	resource_clear(&a);
	resource_clear(&b);
}

static void a_refused_draft_leaves_nothing(void **state)
{
	struct fixture *f = *state;
	struct resource resource;
	enum resource_outcome outcome;
	char mesh[STORE_ID_SIZE], upload[STORE_ID_SIZE];
	struct tw_error failure = {TW_ERROR_INPUT, "bad", "", "broken file"};
	const char *needs[] = {"mesh_none"};
	const char *uploads[] = {upload};
	struct resource_draft draft = {
		.owner = OWNER_DEFAULT, .kind = RESOURCE_MOTION, .needs = needs, .need_count = 1};
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-resource");
	fixture_create(f, RESOURCE_MESH, "v", NULL, NULL, mesh);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	fixture_upload(f, "motion", "walk.pc2", "frames", upload);
	needs[0] = mesh;
	draft.uploads = uploads;
	draft.upload_count = 1;
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_CONFLICT,
		"dependency-failed");
	assert_non_null(strstr(f->error.text, "broken file"));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource"), 1);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM need"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NULL"), 1);
	uploads[0] = "upload_none";
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-upload");
}

static void an_unfinished_or_used_upload_is_refused(void **state)
{
	struct fixture *f = *state;
	struct resource resource;
	enum resource_outcome outcome;
	struct upload *upload = NULL;
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "worn", "a.obj", "", 100, &f->error));
	const char *uploads[] = {upload_id(upload)};
	struct resource_draft draft = {
		.owner = OWNER_DEFAULT, .kind = RESOURCE_MESH, .uploads = uploads, .upload_count = 1};
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_CONFLICT,
		"upload-not-sealed");
	ok(f, upload_write(upload, "v", 1, &f->error));
	ok(f, upload_seal(upload, &f->error));
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_CONFLICT, "upload-used");
	upload_free(upload);
}

static void needs_come_back_in_the_order_given(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motions[5][STORE_ID_SIZE];
	const char *needs[6] = {mesh};
	fixture_create(f, RESOURCE_MESH, "v", NULL, NULL, mesh);
	for (int i = 0; i < 5; i++) {
		char text[2] = {(char)('a' + i), 0};
		fixture_create(f, RESOURCE_MOTION, text, mesh, NULL, motions[i]);
		needs[5 - i] = motions[i];
	}
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_FIELD, .needs = needs, .need_count = 6};
	struct resource field;
	enum resource_outcome outcome;
	char(*ids)[STORE_ID_SIZE];
	size_t count;
	ok(f, resource_create(f->store, &draft, &field, &outcome, &f->error));
	assert_int_equal(field.job.waiting_for, 6);
	ok(f, resource_needs(f->store, field.id, RESOURCE_MOTION, &ids, &count, &f->error));
	assert_int_equal(count, 5);
	for (int i = 0; i < 5; i++)
		assert_string_equal(ids[i], motions[4 - i]);
	free(ids);
	resource_clear(&field);
}

/* Inserts between the pages must neither repeat nor hide what was there before. */
static void pages_do_not_shift_under_inserts(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE], before[25][STORE_ID_SIZE];
	struct resource_query query = {.tenant = TENANT_DEFAULT, .kind = RESOURCE_LAYOUT, .limit = 7};
	struct resource_page page;
	int seen = 0;
	for (int i = 0; i < 25; i++)
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, before[i]);
	do {
		ok(f, resource_list(f->store, &query, &page, &f->error));
		for (size_t i = 0; i < page.count; i++)
			assert_string_equal(page.resources[i].id, before[24 - seen++]);
		query.cursor = page.next;
		resource_page_clear(&page);
		for (int i = 0; i < 5; i++)
			fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	} while (query.cursor);
	assert_int_equal(seen, 25);

	struct job_query jobs = {.tenant = TENANT_DEFAULT, .limit = 1000, .states = 1u << JOB_QUEUED};
	struct job_page job_page;
	ok(f, job_list(f->store, &jobs, &job_page, &f->error));
	assert_int_equal(job_page.count, 45);
	assert_int_equal(job_page.next, 0);
	job_page_clear(&job_page);
	jobs.states = 1u << JOB_FAILED;
	ok(f, job_list(f->store, &jobs, &job_page, &f->error));
	assert_int_equal(job_page.count, 0);
	job_page_clear(&job_page);
}

static void a_list_can_be_narrowed_to_what_is_made_from_one(void **state)
{
	struct fixture *f = *state;
	char mesh[2][STORE_ID_SIZE], motion[STORE_ID_SIZE], other[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_MESH, "a", NULL, NULL, mesh[0]);
	fixture_create(f, RESOURCE_MESH, "b", NULL, NULL, mesh[1]);
	fixture_create(f, RESOURCE_MOTION, "m", mesh[0], NULL, motion);
	fixture_create(f, RESOURCE_MOTION, "m", mesh[1], NULL, other);
	struct resource_query query = {
		.tenant = TENANT_DEFAULT, .kind = RESOURCE_MOTION, .needs = mesh[0], .limit = 10};
	struct resource_page page;
	ok(f, resource_list(f->store, &query, &page, &f->error));
	assert_int_equal(page.count, 1);
	assert_string_equal(page.resources[0].id, motion);
	resource_page_clear(&page);
}

static void what_is_used_is_not_deleted_alone(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE], field[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_MESH, "a", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_MOTION, "m", mesh, NULL, motion);
	fixture_create(f, RESOURCE_FIELD, NULL, motion, NULL, field);
	refused(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, false, &f->error), TW_ERROR_CONFLICT,
		"resource-in-use");
	refused(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MOTION, mesh, false, &f->error),
		TW_ERROR_NOT_FOUND, "no-such-resource");
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource"), 3);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, true, &f->error));
	fixture_sweep(f, 5000);
	static const char *const tables[] = {"resource", "job", "need", "blob", "chunk"};
	for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
		char sql[64];
		snprintf(sql, sizeof sql, "SELECT count(*) FROM %s", tables[i]);
		assert_int_equal(fixture_ask(f, sql), 0);
	}
	fixture_is_sound(f);
}

static void deleting_what_is_being_made_takes_the_lease(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct job_result result = {0};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, id, false, &f->error));
	refused(f, job_finish(f->store, &ticket, &result, &f->error), TW_ERROR_CONFLICT, "lease-lost");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(equal_uploads_are_one_mesh),
		TEST(the_address_keeps_its_fields_apart),
		TEST(a_failed_mesh_is_tried_again_when_it_comes_again),
		TEST(an_idempotency_key_makes_asking_twice_safe),
		TEST(a_refused_draft_leaves_nothing),
		TEST(an_unfinished_or_used_upload_is_refused),
		TEST(needs_come_back_in_the_order_given),
		TEST(pages_do_not_shift_under_inserts),
		TEST(a_list_can_be_narrowed_to_what_is_made_from_one),
		TEST(what_is_used_is_not_deleted_alone),
		TEST(deleting_what_is_being_made_takes_the_lease),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
