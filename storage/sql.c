/* The thin layer over SQLite that the rest of the folder speaks: see sql.h. */
#include "storage/sql.h"

#include "storage/writer.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <time.h>

enum { TROUBLE_MS = 60000 };

struct sql sql_query(struct store *store, const char *text)
{
	struct sql q = {.store = store};
	q.code = connection_prepare(store->connection, text, &q.statement);
	return q;
}

static void note(struct sql *q, int code)
{
	if (q->code == SQLITE_OK && code != SQLITE_OK)
		q->code = code;
}

void sql_bind_int(struct sql *q, int64_t value)
{
	if (q->code == SQLITE_OK)
		note(q, sqlite3_bind_int64(q->statement, ++q->bound, value));
}

void sql_bind_real(struct sql *q, double value)
{
	if (q->code == SQLITE_OK)
		note(q, sqlite3_bind_double(q->statement, ++q->bound, value));
}

void sql_bind_text(struct sql *q, const char *text)
{
	if (q->code == SQLITE_OK)
		note(q, sqlite3_bind_text(q->statement, ++q->bound, text, -1, SQLITE_STATIC));
}

void sql_bind_bytes(struct sql *q, const void *bytes, uint64_t size)
{
	if (q->code == SQLITE_OK)
		note(q, sqlite3_bind_blob64(q->statement, ++q->bound, size ? bytes : "", size, SQLITE_STATIC));
}

bool sql_step(struct sql *q)
{
	if (q->code != SQLITE_OK)
		return false;
	q->column = 0;
	errno = 0;
	int code = sqlite3_step(q->statement);
	if (code != SQLITE_ROW && code != SQLITE_DONE) {
		q->cause = errno;
		note(q, code);
	}
	return code == SQLITE_ROW;
}

bool sql_is_null(const struct sql *q)
{
	return sqlite3_column_type(q->statement, q->column) == SQLITE_NULL;
}

int64_t sql_int(struct sql *q)
{
	return sqlite3_column_int64(q->statement, q->column++);
}

double sql_real(struct sql *q)
{
	return sqlite3_column_double(q->statement, q->column++);
}

const char *sql_text(struct sql *q)
{
	return (const char *)sqlite3_column_text(q->statement, q->column++);
}

const void *sql_bytes(struct sql *q, size_t *size)
{
	const void *bytes = sqlite3_column_blob(q->statement, q->column);
	*size = (size_t)sqlite3_column_bytes(q->statement, q->column++);
	return bytes;
}

void sql_copy_text(struct sql *q, char *out, size_t size)
{
	const char *text = sql_text(q);
	snprintf(out, size, "%s", text ? text : "");
}

char *sql_own_text(struct sql *q)
{
	const char *text = sql_text(q);
	char *copy = text ? strdup(text) : NULL;
	if (text && !copy)
		note(q, SQLITE_NOMEM);
	return copy;
}

enum tw_status sql_end(struct sql *q, struct tw_error *error)
{
	/* The message belongs to the connection, so it has to be taken before the statement is reset. */
	errno = q->cause;
	enum tw_status status =
		q->code == SQLITE_OK ? TW_OK : connection_fail(q->store->connection->db, q->code, error);
	if (q->statement) {
		sqlite3_reset(q->statement);
		sqlite3_clear_bindings(q->statement);
	}
	return status;
}

enum tw_status sql_run(struct sql *q, int64_t *changed, struct tw_error *error)
{
	while (sql_step(q))
		;
	if (changed)
		*changed = q->code == SQLITE_OK ? sqlite3_changes64(q->store->connection->db) : 0;
	return sql_end(q, error);
}

int64_t sql_inserted(const struct store *store)
{
	return sqlite3_last_insert_rowid(store->connection->db);
}

static enum tw_status read_number(struct store *store, const char *text, uint64_t *number, struct tw_error *error)
{
	struct sql q = sql_query(store, text);
	*number = sql_step(&q) ? (uint64_t)sql_int(&q) : 0;
	return sql_end(&q, error);
}

static uint64_t less(uint64_t a, uint64_t b)
{
	return a > b ? a - b : 0;
}

static uint64_t smaller(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

/* What the file may still grow by within its own limit, free pages included. */
static enum tw_status room_in_file(struct store *store, uint64_t *bytes, uint64_t *free_bytes, struct tw_error *error)
{
	uint64_t free_pages = 0, pages = 0, pages_max = 0, page_bytes = 0;
	enum tw_status status = read_number(store, "PRAGMA freelist_count", &free_pages, error);
	if (status == TW_OK)
		status = read_number(store, "PRAGMA page_count", &pages, error);
	if (status == TW_OK)
		status = read_number(store, "PRAGMA max_page_count", &pages_max, error);
	if (status == TW_OK)
		status = read_number(store, "PRAGMA page_size", &page_bytes, error);
	*free_bytes = free_pages * page_bytes;
	*bytes = (less(pages_max, pages) + free_pages) * page_bytes;
	return status;
}

/* Everything is written twice, into the log and from there into the database, which has free pages of its own; and a
 * log that cannot be emptied into a full database can take no more, not even what would make room. So a quarter of the
 * reserve is for the log alone. */
enum tw_status sql_room(struct store *store, uint64_t *bytes, struct tw_error *error)
{
	struct statvfs disk;
	uint64_t in_file = 0, free_bytes = 0;
	const char *path = sqlite3_db_filename(store->connection->db, "main");
	*bytes = UINT64_MAX;
	if (!path || !*path || statvfs(path, &disk))
		return TW_OK;
	enum tw_status status = room_in_file(store, &in_file, &free_bytes, error);
	uint64_t on_disk = (uint64_t)disk.f_bavail * disk.f_frsize;
	uint64_t log_takes = less(on_disk, store->reserve_bytes / 4);
	uint64_t both_take = less(on_disk + free_bytes, store->reserve_bytes) / 2;
	*bytes = smaller(in_file, smaller(log_takes, both_take));
	return status;
}

enum tw_status sql_check_room(struct store *store, uint64_t bytes, struct tw_error *error)
{
	uint64_t room = 0;
	enum tw_status status = sql_room(store, &room, error);
	if (status != TW_OK)
		return status;
	return bytes <= room && room > 0 ? TW_OK : connection_fail_full(error);
}

static int64_t boot_clock_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_BOOTTIME, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

bool sql_had_trouble(const struct store *store)
{
	return store->trouble_ms && boot_clock_ms() - store->trouble_ms < TROUBLE_MS;
}

enum tw_status transaction_begin(struct store *store, bool durable, struct tw_error *error)
{
	assert(store->connection == &store->reads);
	store->durable = durable;
	return writer_begin(store->writer, false, &store->connection, error);
}

enum tw_status transaction_begin_alone(struct store *store, struct tw_error *error)
{
	assert(store->connection == &store->reads);
	store->durable = false;
	return writer_begin(store->writer, true, &store->connection, error);
}

enum tw_status snapshot_begin(struct store *store, struct tw_error *error)
{
	assert(store->connection == &store->reads);
	int code = connection_run(store->connection, "BEGIN");
	return code == SQLITE_OK ? TW_OK : connection_fail(store->connection->db, code, error);
}

/* Nothing was written, so there is nothing that could fail. */
static enum tw_status end_snapshot(struct store *store, enum tw_status status)
{
	if (!sqlite3_get_autocommit(store->reads.db))
		connection_run(&store->reads, "ROLLBACK");
	return status;
}

enum tw_status transaction_end(struct store *store, enum tw_status status, struct tw_error *error)
{
	if (store->connection == &store->reads)
		return end_snapshot(store, status);
	store->connection = &store->reads;
	status = writer_end(store->writer, status, store->durable, error);
	if (status == TW_ERROR_FULL || status == TW_ERROR_IO)
		store->trouble_ms = boot_clock_ms();
	return status;
}
