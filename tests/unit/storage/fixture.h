/* A fresh store in a temporary directory for each test, a clock that stands still until it is moved, and a second
 * connection of plain SQLite as the oracle. */
#ifndef TESTS_UNIT_STORAGE_FIXTURE_H
#define TESTS_UNIT_STORAGE_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "storage/jobs.h"
#include "storage/queue.h"
#include "storage/resources.h"
#include "storage/store.h"
#include "storage/sweep.h"
#include "storage/upload.h"

#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

struct fixture {
	char directory[64];
	char path[128];
	char url[192];
	struct store *store;
	sqlite3 *oracle;
	int64_t now_ms;
	struct tw_error error;
};

static inline int64_t fixture_clock(void *context)
{
	return ((struct fixture *)context)->now_ms;
}

static inline void fixture_check(enum tw_status status, struct fixture *f, const char *file, int line)
{
	if (status != TW_OK)
		print_error("%s: %s\n", f->error.type ? f->error.type : "?", f->error.text);
	_assert_int_equal((uintmax_t)status, TW_OK, file, line);
}
#define ok(f, call) fixture_check((call), (f), __FILE__, __LINE__)

#define refused(f, call, expected_status, expected_type)                                                               \
	do {                                                                                                           \
		assert_int_equal((call), (expected_status));                                                           \
		assert_string_equal((f)->error.type, (expected_type));                                                 \
	} while (0)

static inline int fixture_new_in(void **state, const char *parent)
{
	struct fixture *f = calloc(1, sizeof *f);
	snprintf(f->directory, sizeof f->directory, "%s/tightwire-store-XXXXXX", parent);
	assert_non_null(mkdtemp(f->directory));
	snprintf(f->path, sizeof f->path, "%s/store.db", f->directory);
	snprintf(f->url, sizeof f->url, "sqlite:%s", f->path);
	f->now_ms = 1000000;
	ok(f, store_open(&f->store, f->url, &f->error));
	store_set_clock(f->store, fixture_clock, f);
	assert_int_equal(sqlite3_open(f->path, &f->oracle), SQLITE_OK);
	sqlite3_busy_timeout(f->oracle, 10000);
	*state = f;
	return 0;
}

static inline int fixture_new(void **state)
{
	return fixture_new_in(state, "/tmp");
}

/* In memory, where there is room: for tests that write thousands of times, and nothing about disks. */
static inline int fixture_new_fast(void **state)
{
	struct statvfs memory;
	bool fits = statvfs("/dev/shm", &memory) == 0 && access("/dev/shm", W_OK) == 0 &&
		    (uint64_t)memory.f_bavail * memory.f_frsize > UINT64_C(1) << 30;
	return fixture_new_in(state, fits ? "/dev/shm" : "/tmp");
}

static inline int fixture_free(void **state)
{
	struct fixture *f = *state;
	char command[128];
	store_close(f->store);
	sqlite3_close(f->oracle);
	snprintf(command, sizeof command, "rm -rf %s", f->directory);
	int code = system(command);
	free(f);
	return code;
}

/* The first column of the first row, by a connection that knows nothing of the store's code. */
static inline int64_t fixture_ask(struct fixture *f, const char *sql)
{
	sqlite3_stmt *statement = NULL;
	assert_int_equal(sqlite3_prepare_v2(f->oracle, sql, -1, &statement, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_step(statement), SQLITE_ROW);
	int64_t value = sqlite3_column_int64(statement, 0);
	sqlite3_finalize(statement);
	return value;
}

static inline void fixture_is_sound(struct fixture *f)
{
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM pragma_foreign_key_check"), 0);
	assert_int_equal(fixture_ask(f, "SELECT integrity_check = 'ok' FROM pragma_integrity_check"), 1);
}

static inline void fixture_sweep(struct fixture *f, int64_t upload_age_ms)
{
	bool more = true;
	while (more)
		ok(f, store_sweep(f->store, upload_age_ms, &more, &f->error));
}

/* A sealed upload of text. */
static inline void fixture_upload(struct fixture *f, const char *part, const char *file_name, const char *text,
				  char id[STORE_ID_SIZE])
{
	struct upload *upload = NULL;
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, part, file_name, "application/octet-stream", 1u << 30,
			   &f->error));
	ok(f, upload_write(upload, text, strlen(text), &f->error));
	ok(f, upload_seal(upload, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", upload_id(upload));
	upload_free(upload);
}

/* A resource with at most one upload and one need; its id goes to `id`. */
static inline enum resource_outcome fixture_create(struct fixture *f, enum resource_kind kind, const char *upload,
						   const char *need, const char *options, char id[STORE_ID_SIZE])
{
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = kind, .name = "walk", .options = options};
	char upload_buffer[STORE_ID_SIZE];
	const char *uploads[] = {upload_buffer};
	const char *needs[] = {need};
	if (upload) {
		fixture_upload(f, "worn", "suit.obj", upload, upload_buffer);
		draft.uploads = uploads;
		draft.upload_count = 1;
	}
	if (need) {
		draft.needs = needs;
		draft.need_count = 1;
	}
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", resource.id);
	resource_clear(&resource);
	return outcome;
}

static inline enum job_state fixture_state(struct fixture *f, enum resource_kind kind, const char *id)
{
	struct resource resource;
	ok(f, resource_get(f->store, TENANT_DEFAULT, kind, id, &resource, &f->error));
	enum job_state state = resource.job.state;
	resource_clear(&resource);
	return state;
}

/* Claims; fails the test when there is nothing. */
static inline struct job_ticket fixture_claim(struct fixture *f)
{
	struct job_ticket ticket;
	bool found = false;
	ok(f, job_claim(f->store, &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = "tester", .lease_ms = 5000},
			&ticket, &found, &f->error));
	assert_true(found);
	return ticket;
}

static inline bool fixture_nothing_to_claim(struct fixture *f)
{
	struct job_ticket ticket;
	bool found = true;
	ok(f, job_claim(f->store, &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = "tester", .lease_ms = 5000},
			&ticket, &found, &f->error));
	return !found;
}

static inline void fixture_finish(struct fixture *f, const struct job_ticket *ticket)
{
	struct job_result result = {.summary = "{\"done\":true}"};
	ok(f, job_finish(f->store, ticket, &result, &f->error));
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_new, fixture_free)
#define FAST_TEST(name) cmocka_unit_test_setup_teardown(name, fixture_new_fast, fixture_free)

#endif
