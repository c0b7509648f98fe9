/* Stores of older versions become today's: nothing is lost, and a crash on the way changes nothing. */
#include "tests/unit/storage/fixture.h"

#include "storage/address.h"
#include "storage/schema.h"
#include "tests/unit/storage/old_store.h"

#include <signal.h>
#include <sys/wait.h>

/* What a statement gives, as one text: columns by |, rows by lines, blobs in hexadecimal. */
static char *ask_all(const char *path, const char *sql)
{
	sqlite3 *db = NULL;
	sqlite3_stmt *statement = NULL;
	char *text = NULL;
	size_t size = 0;
	FILE *out = open_memstream(&text, &size);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(sqlite3_prepare_v2(db, sql, -1, &statement, NULL), SQLITE_OK);
	while (sqlite3_step(statement) == SQLITE_ROW) {
		for (int i = 0; i < sqlite3_column_count(statement); i++) {
			if (sqlite3_column_type(statement, i) == SQLITE_BLOB) {
				const unsigned char *bytes = sqlite3_column_blob(statement, i);
				for (int k = 0; k < sqlite3_column_bytes(statement, i); k++)
					fprintf(out, "%02x", bytes[k]);
			} else {
				const char *value = (const char *)sqlite3_column_text(statement, i);
				fputs(value ? value : "NULL", out);
			}
			putc('|', out);
		}
		putc('\n', out);
	}
	sqlite3_finalize(statement);
	sqlite3_close(db);
	fclose(out);
	return text;
}

/* All that a client could have seen of it. */
static const char *const everything[] = {
	"SELECT number, id, kind, name, summary, created_ms FROM resource ORDER BY number",
	"SELECT number, options FROM resource WHERE options NOT LIKE '%\"preset\":\"paper\"%' ORDER BY number",
	"SELECT resource, position, needed FROM need ORDER BY 1, 2",
	/* But for leases and pauses, which were measured by the wall clock and count as over. */
	("SELECT number, id, resource, kind, state, priority, waiting_for, attempts, attempts_max, fence, worker, "
	 "cancel_requested, progress, stage, partial, failure_status, failure_type,"
	 " failure_where, failure_text, created_ms, started_ms, finished_ms, change FROM job ORDER BY number"),
	"SELECT kind, key, fingerprint, resource FROM idempotency ORDER BY 1, 2",
	("SELECT number, resource, upload, role, name, file_name, media_type, type, columns, rows, size, hash FROM blob"
	 " ORDER BY number"),
	"SELECT blob, position, bytes FROM chunk ORDER BY 1, 2",
	"SELECT resource, first, count, samples FROM recording_chunk ORDER BY 1, 2",
	"SELECT value FROM change",
	"SELECT name, seq FROM sqlite_sequence WHERE name IN ('blob', 'job', 'resource') ORDER BY name",
};
enum { QUESTIONS = sizeof everything / sizeof *everything };

static void look_at_everything(const char *path, char *answers[QUESTIONS])
{
	for (size_t i = 0; i < QUESTIONS; i++)
		answers[i] = ask_all(path, everything[i]);
}

static void clear_answers(char *answers[QUESTIONS])
{
	for (size_t i = 0; i < QUESTIONS; i++)
		free(answers[i]);
}

struct old {
	char path[160], url[192];
	char *before[QUESTIONS];
};

static void set_up(struct fixture *f, struct old *old)
{
	snprintf(old->path, sizeof old->path, "%s/old.db", f->directory);
	snprintf(old->url, sizeof old->url, "sqlite:%s", old->path);
	old_store_write(old->path);
	look_at_everything(old->path, old->before);
}

static void nothing_has_changed(struct old *old)
{
	char *after[QUESTIONS];
	look_at_everything(old->path, after);
	for (size_t i = 0; i < QUESTIONS; i++)
		assert_string_equal(after[i], old->before[i]);
	clear_answers(after);
}

static void check_text(struct old *old, const char *sql, const char *expected)
{
	char *answer = ask_all(old->path, sql);
	assert_string_equal(answer, expected);
	free(answer);
}

static void a_store_of_0_1_0_is_migrated_with_all_that_is_in_it(void **state)
{
	struct fixture *f = *state;
	struct old old;
	struct store *store = NULL;
	set_up(f, &old);
	check_text(&old, "PRAGMA user_version", "3|\n");
	check_text(&old, "SELECT DISTINCT state FROM job ORDER BY 1", "0|\n1|\n2|\n3|\n4|\n");
	ok(f, store_open(&store, old.url, &f->error));
	store_close(store);
	nothing_has_changed(&old);
	check_text(&old, "PRAGMA user_version", "5|\n");
	check_text(&old, "PRAGMA integrity_check", "ok|\n");
	check_text(&old, "SELECT count(*) FROM pragma_foreign_key_check", "0|\n");
	check_text(&old, "SELECT DISTINCT tenant, version FROM resource", "1|1|\n");
	check_text(&old, "SELECT DISTINCT tenant FROM idempotency", "1|\n");
	/* It is the schema of a new store, but for the order of columns. */
	const char *objects = "SELECT type, name, tbl_name FROM sqlite_schema ORDER BY 1, 2";
	char *of_new = ask_all(f->path, objects);
	check_text(&old, objects, of_new);
	free(of_new);
	clear_answers(old.before);
}

static void a_preset_that_was_yet_to_be_applied_is_written_down(void **state)
{
	struct fixture *f = *state;
	struct old old;
	struct store *store = NULL;
	set_up(f, &old);
	ok(f, store_open(&store, old.url, &f->error));
	store_close(store);
	check_text(&old,
		   "SELECT options ->> 'preset', options ->> 'energy', options ->> 'overhang' FROM resource"
		   " WHERE kind = 2 ORDER BY 1",
		   "none|stvk|charge|\nnone|tension|charge|\nnone|tension|charge|\nnone|stvk|charge|\n"
		   "none|stvk|charge|\n"
		   "paper|printed|ignore|\n");
	clear_answers(old.before);
}

static void the_queue_of_an_old_store_goes_on(void **state)
{
	struct fixture *f = *state;
	struct old old;
	struct store *usual = f->store;
	set_up(f, &old);
	ok(f, store_open(&f->store, old.url, &f->error));
	/* One was queued, and the lease of another has run out. */
	for (int i = 0; i < 2; i++) {
		struct job_ticket ticket = fixture_claim(f);
		assert_int_equal(ticket.kind, JOB_COMPUTE_LAYOUT);
		fixture_finish(f, &ticket);
		struct resource layout;
		ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, ticket.resource_id, &layout, &f->error));
		/* Whoever asked: it was computed by today's version. */
		assert_int_equal(layout.version, resource_kind_row(RESOURCE_LAYOUT)->version);
		resource_clear(&layout);
	}
	assert_true(fixture_nothing_to_claim(f));
	store_close(f->store);
	f->store = usual;
	check_text(&old, "SELECT state, count(*) FROM job GROUP BY state", "2|16|\n3|2|\n4|2|\n");
	clear_answers(old.before);
}

static int die(void *countdown)
{
	if (--*(int *)countdown == 0)
		kill(getpid(), SIGKILL);
	return 0;
}

/* A process that is killed after so many steps of SQLite's machine. */
static bool killed_while_migrating(const char *path, int steps)
{
	int code = 0;
	pid_t child = fork();
	if (child == 0) {
		sqlite3 *db = NULL;
		int countdown = steps;
		if (sqlite3_open(path, &db) != SQLITE_OK)
			_exit(1);
		sqlite3_progress_handler(db, 1, die, &countdown);
		_exit(schema_migrate(db, SCHEMA_VERSION, NULL) == TW_OK ? 0 : 1);
	}
	waitpid(child, &code, 0);
	if (WIFSIGNALED(code))
		return true;
	assert_int_equal(WEXITSTATUS(code), 0);
	return false;
}

/* Each migration is whole or has not been. */
static void a_crash_in_the_middle_leaves_a_store_of_an_older_version(void **state)
{
	struct fixture *f = *state;
	struct old old;
	set_up(f, &old);
	int kills = 0;
	for (int steps = 1; killed_while_migrating(old.path, steps); steps += 1 + steps / 4) {
		check_text(&old, "SELECT user_version IN (3, 4) FROM pragma_user_version", "1|\n");
		check_text(&old, "PRAGMA integrity_check", "ok|\n");
		nothing_has_changed(&old);
		kills++;
	}
	assert_true(kills >= 20);
	check_text(&old, "PRAGMA user_version", "5|\n");
	nothing_has_changed(&old);
	clear_answers(old.before);
}

static void a_full_disk_in_the_middle_leaves_the_old_store(void **state)
{
	struct fixture *f = *state;
	struct old old;
	struct store *store = NULL;
	char url[256];
	set_up(f, &old);
	char *pages = ask_all(old.path, "PRAGMA page_count");
	snprintf(url, sizeof url, "%s?limit_bytes=%llu", old.url, 8192ull * strtoull(pages, NULL, 10));
	free(pages);
	refused(f, store_open(&store, url, &f->error), TW_ERROR_FULL, "store-full");
	check_text(&old, "PRAGMA user_version", "3|\n");
	nothing_has_changed(&old);
	ok(f, store_open(&store, old.url, &f->error));
	store_close(store);
	check_text(&old, "PRAGMA user_version", "5|\n");
	clear_answers(old.before);
}

/* Daemon and workers of a new release start at the same moment. */
static void many_processes_may_migrate_it_at_once(void **state)
{
	struct fixture *f = *state;
	struct old old;
	pid_t children[6];
	enum { CHILDREN = sizeof children / sizeof *children };
	set_up(f, &old);
	for (int i = 0; i < CHILDREN; i++) {
		children[i] = fork();
		if (children[i] == 0) {
			struct store *store = NULL;
			_exit(store_open(&store, old.url, NULL) == TW_OK ? 0 : 1);
		}
	}
	for (int i = 0; i < CHILDREN; i++) {
		int code = 0;
		waitpid(children[i], &code, 0);
		assert_int_equal(code, 0);
	}
	nothing_has_changed(&old);
	clear_answers(old.before);
}

/* --- what addresses cover --------------------------------------------------------------------------------------- */

static void create_for(struct fixture *f, int64_t tenant, const char *key, char id[STORE_ID_SIZE])
{
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {
		.owner = {tenant, 0}, .kind = key ? RESOURCE_LAYOUT : RESOURCE_FIELD, .idempotency_key = key};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", resource.id);
	resource_clear(&resource);
}

static void tenants_share_neither_addresses_nor_keys(void **state)
{
	struct fixture *f = *state;
	char own[STORE_ID_SIZE], again[STORE_ID_SIZE], other[STORE_ID_SIZE];
	int64_t mill = 0;
	ok(f, tenant_create(f->store, "mill", &mill, &f->error));
	for (int i = 0; i < 2; i++) {
		const char *key = i ? "order-1" : NULL;
		create_for(f, TENANT_DEFAULT, key, own);
		create_for(f, TENANT_DEFAULT, key, again);
		create_for(f, mill, key, other);
		assert_string_equal(own, again);
		assert_string_not_equal(own, other);
	}
}

/* The key of an order that was placed before an upgrade finds it after the upgrade. */
static void the_fingerprint_of_a_request_knows_no_version(void **state)
{
	struct fixture *f = *state;
	struct old old;
	struct store *usual = f->store;
	set_up(f, &old);
	ok(f, store_open(&f->store, old.url, &f->error));
	char *row = ask_all(old.path, "SELECT r.id, r.options, f.id, hex(i.fingerprint) FROM idempotency i"
				      " JOIN resource r ON r.number = i.resource JOIN need n ON n.resource = r.number"
				      " JOIN resource f ON f.number = n.needed");
	char *rest = row, *id = strsep(&rest, "|"), *options = strsep(&rest, "|"), *field = strsep(&rest, "|");
	struct resource_draft draft = {
		.owner = OWNER_DEFAULT,
		.kind = RESOURCE_LAYOUT,
		.options = options,
		.needs = (const char *const[]){field},
		.need_count = 1,
		.idempotency_key = "order-17",
	};
	struct resource layout;
	enum resource_outcome outcome;
	ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_EXISTED);
	assert_string_equal(layout.id, id);
	assert_int_equal(layout.job.state, JOB_SUCCEEDED);
	resource_clear(&layout);
	struct content_hash fingerprint, address;
	ok(f, address_fingerprint(f->store, &draft, &fingerprint, &f->error));
	ok(f, address_of(f->store, &draft, &fingerprint, &address, &f->error));
	assert_memory_not_equal(&fingerprint, &address, sizeof address);
	free(row);
	store_close(f->store);
	f->store = usual;
	clear_answers(old.before);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_store_of_0_1_0_is_migrated_with_all_that_is_in_it),
		TEST(a_preset_that_was_yet_to_be_applied_is_written_down),
		TEST(the_queue_of_an_old_store_goes_on),
		TEST(a_crash_in_the_middle_leaves_a_store_of_an_older_version),
		TEST(a_full_disk_in_the_middle_leaves_the_old_store),
		TEST(many_processes_may_migrate_it_at_once),
		TEST(tenants_share_neither_addresses_nor_keys),
		TEST(the_fingerprint_of_a_request_knows_no_version),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
