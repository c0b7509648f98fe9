/* Tenants: what is another's is not there; and one is deleted whole. */
#include "storage/access.h"
#include "storage/bulk.h"
#include "storage/recording.h"
#include "tests/unit/storage/fixture.h"

#include <signal.h>
#include <sys/wait.h>

static int64_t make_tenant(struct fixture *f, const char *name)
{
	int64_t number = 0;
	ok(f, tenant_create(f->store, name, &number, &f->error));
	return number;
}

static enum resource_outcome create_for(struct fixture *f, int64_t tenant, enum resource_kind kind, const char *upload,
					const char *need, struct resource *resource)
{
	enum resource_outcome outcome;
	struct upload *begun = NULL;
	char id[STORE_ID_SIZE];
	const char *uploads[] = {id}, *needs[] = {need};
	struct resource_draft draft = {.owner = {tenant, 0},
				       .kind = kind,
				       .name = "walk",
				       .uploads = uploads,
				       .upload_count = upload != NULL,
				       .needs = needs,
				       .need_count = need != NULL};
	if (upload) {
		ok(f, upload_begin(&begun, f->store, draft.owner, "worn", "suit.obj", "", 1u << 20, &f->error));
		ok(f, upload_write(begun, upload, strlen(upload), &f->error));
		ok(f, upload_seal(begun, &f->error));
		snprintf(id, sizeof id, "%s", upload_id(begun));
		upload_free(begun);
	}
	ok(f, resource_create(f->store, &draft, resource, &outcome, &f->error));
	return outcome;
}

static void names_of_tenants_are_checked_and_unique(void **state)
{
	struct fixture *f = *state;
	int64_t number = 0, found = 0;
	static const char *const wrong[] = {"", "-mill", ".mill", "Mill", "two words", "a/b", "\xc3\xa4"};
	char longest[TENANT_NAME_SIZE + 1];
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
		refused(f, tenant_create(f->store, wrong[i], &number, &f->error), TW_ERROR_INPUT, "tenant-name");
	memset(longest, 'a', sizeof longest);
	longest[TENANT_NAME_SIZE] = '\0';
	refused(f, tenant_create(f->store, longest, &number, &f->error), TW_ERROR_INPUT, "tenant-name");
	longest[TENANT_NAME_SIZE - 1] = '\0';
	ok(f, tenant_create(f->store, longest, &number, &f->error));
	ok(f, tenant_find(f->store, longest, &found, &f->error));
	assert_int_equal(found, number);
	refused(f, tenant_create(f->store, "default", &number, &f->error), TW_ERROR_CONFLICT, "tenant-exists");
	refused(f, tenant_find(f->store, "mill", &found, &f->error), TW_ERROR_NOT_FOUND, "no-such-tenant");
}

static void equal_content_in_two_tenants_is_two_resources(void **state)
{
	struct fixture *f = *state;
	struct resource ours, theirs, again;
	int64_t mill = make_tenant(f, "mill"), weaver = make_tenant(f, "weaver");
	assert_int_equal(create_for(f, mill, RESOURCE_MESH, "v 1 2 3", NULL, &ours), RESOURCE_CREATED);
	assert_int_equal(create_for(f, weaver, RESOURCE_MESH, "v 1 2 3", NULL, &theirs), RESOURCE_CREATED);
	assert_string_not_equal(ours.id, theirs.id);
	assert_int_equal(create_for(f, mill, RESOURCE_MESH, "v 1 2 3", NULL, &again), RESOURCE_EXISTED);
	assert_string_equal(again.id, ours.id);
	resource_clear(&ours);
	resource_clear(&theirs);
	resource_clear(&again);
}

static void what_is_another_tenants_is_not_there(void **state)
{
	struct fixture *f = *state;
	int64_t mill = make_tenant(f, "mill");
	struct resource mesh, none, layout;
	struct job job = {0};
	struct upload *upload = NULL;
	struct blob blob;
	uint64_t offset;
	bool sealed;
	enum job_state after;
	enum resource_outcome outcome;
	create_for(f, TENANT_DEFAULT, RESOURCE_MESH, "v", NULL, &mesh);
	for (int64_t tenant = 0; tenant <= mill; tenant += mill) {
		refused(f, resource_get(f->store, tenant, RESOURCE_MESH, mesh.id, &none, &f->error), TW_ERROR_NOT_FOUND,
			"no-such-resource");
		refused(f, resource_delete(f->store, tenant, RESOURCE_MESH, mesh.id, true, &f->error),
			TW_ERROR_NOT_FOUND, "no-such-resource");
		refused(f, job_get(f->store, tenant, mesh.job.id, &job, &f->error), TW_ERROR_NOT_FOUND, "no-such-job");
		refused(f, job_cancel(f->store, tenant, mesh.job.id, &after, &f->error), TW_ERROR_NOT_FOUND,
			"no-such-job");
		refused(f, job_redrive(f->store, tenant, mesh.job.id, &f->error), TW_ERROR_NOT_FOUND, "no-such-job");
	}
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "worn", "", "", 100, &f->error));
	char id[STORE_ID_SIZE];
	snprintf(id, sizeof id, "%s", upload_id(upload));
	upload_free(upload);
	refused(f, upload_find(f->store, mill, id, &blob, &sealed, &f->error), TW_ERROR_NOT_FOUND, "no-such-upload");
	refused(f, upload_resume(&upload, f->store, mill, id, 100, &offset, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-upload");
	refused(f, upload_discard(f->store, mill, id, &f->error), TW_ERROR_NOT_FOUND, "no-such-upload");
	const char *uploads[] = {id}, *needs[] = {mesh.id};
	struct resource_draft draft = {
		.owner = {mill, 0}, .kind = RESOURCE_MESH, .uploads = uploads, .upload_count = 1};
	refused(f, resource_create(f->store, &draft, &none, &outcome, &f->error), TW_ERROR_NOT_FOUND, "no-such-upload");
	draft = (struct resource_draft){.owner = {mill, 0}, .kind = RESOURCE_FIELD, .needs = needs, .need_count = 1};
	refused(f, resource_create(f->store, &draft, &none, &outcome, &f->error), TW_ERROR_NOT_FOUND,
		"no-such-resource");
	/* The same idempotency key is another one. */
	draft = (struct resource_draft){
		.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .options = "{}", .idempotency_key = "order-1"};
	ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
	draft.owner.tenant = mill;
	draft.options = "{\"other\":1}";
	ok(f, resource_create(f->store, &draft, &none, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_CREATED);
	assert_string_not_equal(layout.id, none.id);
	resource_clear(&layout);
	resource_clear(&none);
	resource_clear(&mesh);
}

static void lists_show_the_tenants_own(void **state)
{
	struct fixture *f = *state;
	const int64_t tenants[] = {TENANT_DEFAULT, make_tenant(f, "mill")};
	struct resource mesh, motion;
	for (int round = 0; round < 3; round++)
		for (int i = 0; i < 2; i++) {
			char text[16];
			snprintf(text, sizeof text, "v %d", round);
			create_for(f, tenants[i], RESOURCE_MESH, text, NULL, &mesh);
			create_for(f, tenants[i], RESOURCE_MOTION, text, mesh.id, &motion);
			resource_clear(&mesh);
			resource_clear(&motion);
		}
	for (int i = 0; i < 2; i++) {
		struct resource_query meshes = {.tenant = tenants[i], .kind = RESOURCE_MESH, .limit = 100};
		struct job_query jobs = {.tenant = tenants[i], .limit = 100};
		struct resource_page resources;
		struct job_page page;
		ok(f, resource_list(f->store, &meshes, &resources, &f->error));
		assert_int_equal(resources.count, 3);
		/* The motions of another's mesh: none. */
		struct resource_query motions = {.tenant = tenants[!i],
						 .kind = RESOURCE_MOTION,
						 .needs = resources.resources[0].id,
						 .limit = 100};
		for (size_t k = 0; k < 3; k++)
			assert_int_equal(resources.resources[k].owner.tenant, tenants[i]);
		struct resource_page none;
		ok(f, resource_list(f->store, &motions, &none, &f->error));
		assert_int_equal(none.count, 0);
		resource_page_clear(&none);
		resource_page_clear(&resources);
		for (unsigned kinds = 0; kinds < 2; kinds++) {
			jobs.kinds = kinds ? JOB_KIND_BIT(JOB_IMPORT_MESH) | JOB_KIND_BIT(JOB_IMPORT_MOTION) : 0;
			ok(f, job_list(f->store, &jobs, &page, &f->error));
			assert_int_equal(page.count, 6);
			job_page_clear(&page);
		}
	}
}

static void a_redrive_takes_the_tenants_own(void **state)
{
	struct fixture *f = *state;
	const int64_t mill = make_tenant(f, "mill");
	struct tw_error failure = {TW_ERROR_FULL, "store-full", "", "full"};
	struct resource mesh;
	for (int i = 0; i < 2; i++) {
		create_for(f, i ? mill : TENANT_DEFAULT, RESOURCE_MESH, "v", NULL, &mesh);
		resource_clear(&mesh);
		struct job_ticket ticket = fixture_claim(f);
		ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	}
	for (int i = 0; i < 2; i++) {
		struct job_query query = {
			.tenant = mill, .states = 1u << JOB_FAILED, .failure_type = i ? NULL : "store-full"};
		struct bulk_progress progress = {0};
		while (!progress.done)
			ok(f, bulk_step(f->store, BULK_REDRIVE, &query, &progress, &f->error));
		assert_int_equal(progress.changed, i ? 0 : 1);
	}
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 3 AND tenant = 1"), 1);
}

/* --- deleting --------------------------------------------------------------------------------------------------- */

static void fill(struct fixture *f, int64_t tenant)
{
	struct resource mesh, motion, layout;
	struct upload *upload = NULL;
	create_for(f, tenant, RESOURCE_MESH, "v 1", NULL, &mesh);
	for (int i = 0; i < 40; i++) {
		char text[32];
		snprintf(text, sizeof text, "frame %d", i);
		create_for(f, tenant, RESOURCE_MOTION, text, mesh.id, &motion);
		create_for(f, tenant, RESOURCE_LAYOUT, NULL, motion.id, &layout);
		resource_clear(&motion);
		resource_clear(&layout);
	}
	for (int i = 0; i < 40; i++) {
		ok(f, upload_begin(&upload, f->store, (struct owner){tenant, 0}, "worn", "", "", 100, &f->error));
		ok(f, upload_write(upload, "v", 1, &f->error));
		ok(f, upload_seal(upload, &f->error));
		upload_free(upload);
	}
	resource_clear(&mesh);
}

static void sweep_tenants(struct fixture *f)
{
	bool more = true;
	while (more)
		ok(f, tenant_sweep(f->store, &more, &f->error));
	fixture_sweep(f, 100000);
}

/* Everything in the store that says whose it is. */
static int64_t rows_of(struct fixture *f, int64_t tenant)
{
	static const char *const tables[] = {"resource", "job",       "idempotency", "api_key",
					     "share",    "job_group", "job_count"};
	char sql[128];
	int64_t rows = 0;
	for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
		snprintf(sql, sizeof sql, "SELECT count(*) FROM %s WHERE tenant = %lld", tables[i], (long long)tenant);
		rows += fixture_ask(f, sql);
	}
	snprintf(sql, sizeof sql, "SELECT count(*) FROM blob WHERE tenant = %lld", (long long)tenant);
	return rows + fixture_ask(f, sql);
}

static void a_deleted_tenant_leaves_nothing_and_nobody_else_misses_anything(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	struct key key;
	int64_t mill = make_tenant(f, "mill"), again = 0, found = 0;
	fill(f, TENANT_DEFAULT);
	struct job_ticket ticket = fixture_claim(f);
	int64_t others = rows_of(f, TENANT_DEFAULT);
	fill(f, mill);
	struct key_draft draft = {.tenant = mill, .name = "mes", .scopes = KEY_SCOPES_ALL};
	ok(f, key_create(f->store, &draft, &key, secret, &f->error));
	ok(f, tenant_delete(f->store, "mill", &f->error));
	refused(f, tenant_find(f->store, "mill", &found, &f->error), TW_ERROR_NOT_FOUND, "no-such-tenant");
	refused(f, tenant_delete(f->store, "mill", &f->error), TW_ERROR_NOT_FOUND, "no-such-tenant");
	struct access access;
	ok(f, access_read(f->store, &access, &f->error));
	assert_int_equal(access.count, 0);
	access_clear(&access);
	/* The name is free at once, and what comes under it is another's. */
	again = make_tenant(f, "mill");
	assert_int_not_equal(again, mill);
	struct resource mesh;
	assert_int_equal(create_for(f, again, RESOURCE_MESH, "v 1", NULL, &mesh), RESOURCE_CREATED);
	sweep_tenants(f);
	assert_int_equal(rows_of(f, mill), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM tenant WHERE name IS NULL"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM turn WHERE share NOT IN (SELECT number FROM share)"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM lane WHERE share NOT IN (SELECT number FROM share)"), 0);
	assert_int_equal(rows_of(f, TENANT_DEFAULT), others);
	assert_int_equal(fixture_state(f, RESOURCE_MESH, ticket.resource_id), JOB_RUNNING);
	struct resource still;
	ok(f, resource_get(f->store, again, RESOURCE_MESH, mesh.id, &still, &f->error));
	resource_clear(&still);
	resource_clear(&mesh);
	fixture_is_sound(f);
}

static void nothing_new_comes_into_a_deleted_tenant(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	int64_t mill = make_tenant(f, "mill");
	struct resource resource;
	enum resource_outcome outcome;
	struct upload *upload = NULL;
	struct key key;
	const struct key_draft draft = {.tenant = mill, .name = "mes", .scopes = KEY_READ};
	ok(f, tenant_delete(f->store, "mill", &f->error));
	for (int i = 0; i < 2; i++) {
		struct resource_draft layout = {.owner = {mill, 0}, .kind = i ? RESOURCE_LAYOUT : RESOURCE_FIELD};
		refused(f, resource_create(f->store, &layout, &resource, &outcome, &f->error), TW_ERROR_NOT_FOUND,
			"no-such-tenant");
	}
	refused(f, upload_begin(&upload, f->store, (struct owner){mill, 0}, "worn", "", "", 100, &f->error),
		TW_ERROR_NOT_FOUND, "no-such-tenant");
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_NOT_FOUND, "no-such-tenant");
}

static void the_default_tenant_begins_anew(void **state)
{
	struct fixture *f = *state;
	int64_t next = 0;
	struct resource before, after;
	create_for(f, TENANT_DEFAULT, RESOURCE_MESH, "v", NULL, &before);
	ok(f, tenant_delete(f->store, "default", &f->error));
	ok(f, tenant_find(f->store, "default", &next, &f->error));
	assert_int_not_equal(next, TENANT_DEFAULT);
	struct access access;
	ok(f, access_read(f->store, &access, &f->error));
	assert_int_equal(access.default_tenant, next);
	access_clear(&access);
	assert_int_equal(create_for(f, next, RESOURCE_MESH, "v", NULL, &after), RESOURCE_CREATED);
	assert_string_not_equal(before.id, after.id);
	sweep_tenants(f);
	assert_int_equal(rows_of(f, TENANT_DEFAULT), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource"), 1);
	resource_clear(&before);
	resource_clear(&after);
}

/* Killed again and again in the middle: it goes on where it was. */
static void a_deletion_survives_kills(void **state)
{
	struct fixture *f = *state;
	int64_t mill = make_tenant(f, "mill");
	fill(f, TENANT_DEFAULT);
	int64_t others = rows_of(f, TENANT_DEFAULT);
	fill(f, mill);
	ok(f, tenant_delete(f->store, "mill", &f->error));
	int kills = 0;
	for (bool over = false; !over;) {
		int code = 0;
		pid_t child = fork();
		if (child == 0) {
			struct store *store = NULL;
			bool more = true;
			if (store_open(&store, f->url, NULL) != TW_OK || tenant_sweep(store, &more, NULL) != TW_OK)
				_exit(2);
			if (!more)
				_exit(0);
			kill(getpid(), SIGKILL);
		}
		waitpid(child, &code, 0);
		kills += WIFSIGNALED(code);
		over = !WIFSIGNALED(code);
		assert_int_equal(over ? WEXITSTATUS(code) : 0, 0);
	}
	assert_true(kills >= 4);
	assert_int_equal(rows_of(f, mill), 0);
	assert_int_equal(rows_of(f, TENANT_DEFAULT), others);
	fixture_is_sound(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(names_of_tenants_are_checked_and_unique),
		TEST(equal_content_in_two_tenants_is_two_resources),
		TEST(what_is_another_tenants_is_not_there),
		TEST(lists_show_the_tenants_own),
		TEST(a_redrive_takes_the_tenants_own),
		TEST(a_deleted_tenant_leaves_nothing_and_nobody_else_misses_anything),
		TEST(nothing_new_comes_into_a_deleted_tenant),
		TEST(the_default_tenant_begins_anew),
		TEST(a_deletion_survives_kills),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
