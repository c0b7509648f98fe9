/* Opening, migrating, filling up and copying the store. */
#include "tests/unit/storage/fixture.h"

#include "storage/schema.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

static void run_sql(const char *path, const char *sql)
{
	sqlite3 *db = NULL;
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
	sqlite3_close(db);
}

static void a_new_store_is_as_the_design_wants_it(void **state)
{
	struct fixture *f = *state;
	assert_int_equal(fixture_ask(f, "PRAGMA application_id"), SCHEMA_APPLICATION_ID);
	assert_int_equal(fixture_ask(f, "PRAGMA user_version"), SCHEMA_VERSION);
	assert_int_equal(fixture_ask(f, "SELECT journal_mode = 'wal' FROM pragma_journal_mode"), 1);
	assert_int_equal(fixture_ask(f,
				     "SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND type = 'table'"
				     " AND NOT strict AND name NOT LIKE 'sqlite_%'"),
			 0);
	ok(f, store_ping(f->store, &f->error));
	fixture_is_sound(f);
}

static void an_url_that_is_not_understood_is_refused(void **state)
{
	struct fixture *f = *state;
	static const char *const urls[] = {"",
					   "store.db",
					   "sqlite:",
					   "postgres://x",
					   "sqlite:?limit_bytes=1",
					   "sqlite:/tmp/x?limit_bytes=",
					   "sqlite:/tmp/x?limit_bytes=-5",
					   "sqlite:/tmp/x?limit_bytes=9999999999999999999999",
					   "sqlite:/tmp/x?cache=1",
					   "sqlite::memory:",
					   "sqlite::memory:?limit_bytes=9000000"};
	struct store *store = NULL;
	for (size_t i = 0; i < sizeof urls / sizeof urls[0]; i++)
		refused(f, store_open(&store, urls[i], &f->error), TW_ERROR_INPUT, "store-url");
	refused(f, store_open(&store, "sqlite:/nonexistent/folder/x.db", &f->error), TW_ERROR_IO, "store-io");
	refused(f, store_open_existing(&store, "sqlite:/nonexistent/x.db", &f->error), TW_ERROR_NOT_FOUND,
		"no-such-store");
}

static void a_store_of_the_first_version_is_migrated_with_its_data(void **state)
{
	struct fixture *f = *state;
	char path[160], url[192];
	sqlite3 *db = NULL;
	struct store *store = NULL;
	struct resource resource;
	snprintf(path, sizeof path, "%s/old.db", f->directory);
	snprintf(url, sizeof url, "sqlite:%s", path);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	ok(f, schema_migrate(db, 1, &f->error));
	assert_int_equal(sqlite3_exec(db,
				      "INSERT INTO resource VALUES (1, 'mesh_old', 0, 'suit', '{}', NULL, 5);"
				      "INSERT INTO job(id, resource, kind, attempts_max, created_ms)"
				      " VALUES ('job_old', 1, 0, 3, 5)",
				      NULL, NULL, NULL),
			 SQLITE_OK);
	sqlite3_close(db);
	ok(f, store_open(&store, url, &f->error));
	ok(f, resource_get(store, TENANT_DEFAULT, RESOURCE_MESH, "mesh_old", &resource, &f->error));
	assert_string_equal(resource.name, "suit");
	assert_int_equal(resource.job.state, JOB_QUEUED);
	resource_clear(&resource);
	store_close(store);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(sqlite3_exec(db, "SELECT count(*) FROM recording_chunk", NULL, NULL, NULL), SQLITE_OK);
	sqlite3_close(db);
}

static char *read_file(const char *path, size_t *size)
{
	FILE *file = fopen(path, "rb");
	char *bytes = calloc(1, 1 << 20);
	*size = fread(bytes, 1, 1 << 20, file);
	fclose(file);
	return bytes;
}

static void what_is_not_ours_is_left_alone(void **state)
{
	struct fixture *f = *state;
	char path[160], url[192];
	size_t size = 0;
	struct store *store = NULL;
	snprintf(path, sizeof path, "%s/other.db", f->directory);
	snprintf(url, sizeof url, "sqlite:%s", path);
	run_sql(path, "CREATE TABLE shopping(item TEXT)");
	char *before = read_file(path, &size), *after;
	refused(f, store_open(&store, url, &f->error), TW_ERROR_INPUT, "store-foreign");
	after = read_file(path, &size);
	assert_memory_equal(before, after, size);
	free(before);
	free(after);
	FILE *file = fopen(path, "w");
	for (int i = 0; i < 1000; i++)
		fputs("this is a letter, not a database\n", file);
	fclose(file);
	refused(f, store_open(&store, url, &f->error), TW_ERROR_INPUT, "store-foreign");
	run_sql(f->path, "PRAGMA user_version = 99");
	refused(f, store_open(&store, f->url, &f->error), TW_ERROR_UNSUPPORTED, "store-newer");
}

/* Daemon and workers start at the same moment on a store that is not there yet. */
static void many_processes_may_create_it_at_once(void **state)
{
	struct fixture *f = *state;
	char path[160], url[192];
	snprintf(path, sizeof path, "%s/race.db", f->directory);
	snprintf(url, sizeof url, "sqlite:%s", path);
	for (int round = 0; round < 5; round++) {
		pid_t children[8];
		for (int i = 0; i < 8; i++) {
			children[i] = fork();
			if (children[i] == 0) {
				struct store *store = NULL;
				struct tw_error error = {0};
				enum tw_status status = store_open(&store, url, &error);
				if (status != TW_OK)
					print_error("%s\n", error.text);
				_exit(status == TW_OK ? 0 : 1);
			}
		}
		for (int i = 0; i < 8; i++) {
			int code = 0;
			waitpid(children[i], &code, 0);
			assert_int_equal(code, 0);
		}
		run_sql(path, "SELECT count(*) FROM job; SELECT count(*) FROM rig");
		char command[600];
		snprintf(command, sizeof command, "rm -f %s %s-wal %s-shm", path, path, path);
		assert_int_equal(system(command), 0);
	}
}

/* Fills the store until it says no. */
static enum tw_status fill(struct fixture *f, struct store *store, char id[STORE_ID_SIZE])
{
	static const char block[65536] = "x";
	struct upload *upload = NULL;
	enum tw_status status = upload_begin(&upload, store, OWNER_DEFAULT, "worn", "big.obj", "", 1u << 30, &f->error);
	for (int i = 0; status == TW_OK && i < 2000; i++)
		status = upload_write(upload, block, sizeof block, &f->error);
	if (upload)
		snprintf(id, STORE_ID_SIZE, "%s", upload_id(upload));
	upload_free(upload);
	return status;
}

static void a_full_store_says_so_and_goes_on_when_there_is_room(void **state)
{
	struct fixture *f = *state;
	char url[256], id[STORE_ID_SIZE], layout[STORE_ID_SIZE];
	char *big = calloc(1, 4u << 20);
	struct store *usual = f->store;
	struct job_artifact artifact = {"big.bin", "application/octet-stream", big, 4u << 20};
	struct job_result result = {.summary = "{}", .artifacts = &artifact, .artifact_count = 1};
	snprintf(url, sizeof url, "%s?limit_bytes=%u", f->url, 6u << 20);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, layout);
	struct job_ticket ticket = fixture_claim(f); /* while there was room */
	ok(f, store_open(&f->store, url, &f->error));
	refused(f, fill(f, f->store, id), TW_ERROR_FULL, "store-full");

	refused(f, job_finish(f->store, &ticket, &result, &f->error), TW_ERROR_FULL, "store-full");
	assert_int_equal(fixture_ask(f, "SELECT state FROM job"), JOB_RUNNING);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE role = 2"), 0);
	fixture_is_sound(f);

	ok(f, upload_discard(f->store, TENANT_DEFAULT, id, &f->error));
	fixture_sweep(f, 5000);
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT size FROM blob WHERE role = 2"), 4 << 20);
	fixture_is_sound(f);
	store_close(f->store);
	f->store = usual;
	free(big);
}

/* What makes room, and what ends jobs, must not need the room that is not there. */
static void the_reserve_is_for_what_makes_room(void **state)
{
	struct fixture *f = *state;
	char url[256], upload[STORE_ID_SIZE], mesh[STORE_ID_SIZE], layout[STORE_ID_SIZE];
	struct upload *refused_upload = NULL;
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT};
	struct job_result result = {.summary = "{}"};
	struct tw_error failure = {TW_ERROR_FULL, "store-full", "", "full"};
	fixture_upload(f, "worn", "a.obj", "forgotten", upload);
	fixture_create(f, RESOURCE_MESH, "a mesh", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, layout);
	struct store *usual = f->store;
	struct job_ticket ticket = fixture_claim(f);
	snprintf(url, sizeof url, "%s?reserve_bytes=%llu", f->url, 1ull << 62);
	ok(f, store_open(&f->store, url, &f->error));
	store_set_clock(f->store, fixture_clock, f);
	assert_true(fixture_nothing_to_claim(f)); /* no room for what would come of it */

	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_FULL, "store-full");
	refused(f, job_finish(f->store, &ticket, &result, &f->error), TW_ERROR_FULL, "store-full");
	ok(f, upload_begin(&refused_upload, f->store, OWNER_DEFAULT, "worn", "", "", 100, &f->error));
	ok(f, upload_write(refused_upload, "x", 1, &f->error));
	refused(f, upload_seal(refused_upload, &f->error), TW_ERROR_FULL, "store-full");
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload_id(refused_upload), &f->error));
	upload_free(refused_upload);

	ok(f, job_fail(f->store, &ticket, &failure, true, &f->error));
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload, &f->error));
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, layout, false, &f->error));
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, false, &f->error));
	fixture_sweep(f, 5000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	store_close(f->store);
	f->store = usual;
	fixture_is_sound(f);
}

/* As when the disk is full: the operating system refuses the write in the middle of it. */
static void a_refused_write_loses_nothing_that_was_acknowledged(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_MESH, "acknowledged", NULL, NULL, id);
	pid_t child = fork();
	if (child == 0) {
		struct rlimit limit = {3u << 20, 3u << 20};
		struct store *store = NULL;
		signal(SIGXFSZ, SIG_IGN);
		setrlimit(RLIMIT_FSIZE, &limit);
		enum tw_status status = store_open(&store, f->url, &f->error);
		if (status == TW_OK)
			status = fill(f, store, id);
		bool told = status == TW_ERROR_FULL && !strcmp(f->error.type, "store-full");
		_exit(told && store_ping(store, NULL) == TW_OK ? 0 : 1);
	}
	int code = 0;
	waitpid(child, &code, 0);
	assert_int_equal(code, 0);
	fixture_is_sound(f);
	struct job_ticket ticket = fixture_claim(f);
	fixture_finish(f, &ticket);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 2"), 1);
}

static void a_backup_is_a_whole_store(void **state)
{
	struct fixture *f = *state;
	char path[160], url[192], mesh[STORE_ID_SIZE];
	struct store *copy = NULL;
	struct resource resource;
	snprintf(path, sizeof path, "%s/copy.db", f->directory);
	snprintf(url, sizeof url, "sqlite:%s", path);
	fixture_create(f, RESOURCE_MESH, "v 1 2 3", NULL, NULL, mesh);
	ok(f, store_backup(f->store, path, &f->error));
	refused(f, store_backup(f->store, path, &f->error), TW_ERROR_CONFLICT, "backup-exists");
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, false, &f->error));
	ok(f, store_open(&copy, url, &f->error));
	ok(f, resource_get(copy, TENANT_DEFAULT, RESOURCE_MESH, mesh, &resource, &f->error));
	resource_clear(&resource);
	store_close(copy);
	refused(f, store_backup(f->store, "/nonexistent/copy.db", &f->error), TW_ERROR_IO, "backup-io");
}

/* What the rest of the code relies on, asked of SQLite itself. */
static void a_broken_reference_is_refused(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_MESH, "a", NULL, NULL, mesh);
	fixture_create(f, RESOURCE_MOTION, "m", mesh, NULL, motion);
	assert_int_equal(sqlite3_exec(f->oracle, "PRAGMA foreign_keys = ON", NULL, NULL, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_exec(f->oracle, "DELETE FROM resource WHERE kind = 0", NULL, NULL, NULL),
			 SQLITE_CONSTRAINT);
	assert_int_equal(sqlite3_exec(f->oracle, "UPDATE job SET resource = 77 WHERE number = 1", NULL, NULL, NULL),
			 SQLITE_CONSTRAINT);
	assert_int_equal(sqlite3_exec(f->oracle, "UPDATE job SET attempts = 'many' WHERE number = 1", NULL, NULL, NULL),
			 SQLITE_CONSTRAINT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_new_store_is_as_the_design_wants_it),
		TEST(an_url_that_is_not_understood_is_refused),
		TEST(a_store_of_the_first_version_is_migrated_with_its_data),
		TEST(what_is_not_ours_is_left_alone),
		TEST(many_processes_may_create_it_at_once),
		TEST(a_full_store_says_so_and_goes_on_when_there_is_room),
		TEST(the_reserve_is_for_what_makes_room),
		TEST(a_refused_write_loses_nothing_that_was_acknowledged),
		TEST(a_backup_is_a_whole_store),
		TEST(a_broken_reference_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
