/* The thin layer over SQLite that the rest of the folder speaks: see sql.h. */
#include "storage/sql.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

/* A file size limit and a quota mean the same to a client as a full disk, but only ENOSPC is SQLITE_FULL. (errno
 * itself, because sqlite3_system_errno does not know of the errors of a COMMIT.) */
static bool is_full(int code, int cause)
{
	return code == SQLITE_FULL || (code == SQLITE_IOERR && (cause == EFBIG || cause == EDQUOT || cause == ENOSPC));
}

static enum tw_status fail_full(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_FULL, "store-full", NULL,
		       "the store is full; free space on its disk or delete resources, then try again");
}

enum tw_status sql_fail(sqlite3 *db, int code, struct tw_error *error)
{
	int cause = errno;
	int primary = code & 0xff;
	const char *message = db ? sqlite3_errmsg(db) : sqlite3_errstr(code);
	if (is_full(primary, cause))
		return fail_full(error);
	switch (primary) {
	case SQLITE_NOMEM:
		return tw_fail_memory(error);
	case SQLITE_BUSY:
	case SQLITE_LOCKED:
		return tw_fail(error, TW_ERROR_IO, "store-busy", NULL,
			       "the store was locked by another process for too long; try again");
	case SQLITE_CORRUPT:
	case SQLITE_NOTADB:
		return tw_fail(error, TW_ERROR_IO, "store-damaged", NULL,
			       "the store is damaged (%s); restore it from a backup", message);
	case SQLITE_TOOBIG:
		return tw_fail(error, TW_ERROR_LIMIT, "store-row-too-large", NULL,
			       "one row is too large for the store");
	case SQLITE_CONSTRAINT:
	case SQLITE_MISUSE:
	case SQLITE_ERROR:
		return tw_fail(error, TW_ERROR_INTERNAL, "store-internal", NULL, "the store refused a statement: %s",
			       message);
	default:
		return tw_fail(error, TW_ERROR_IO, "store-io", NULL, "the store cannot be read or written: %s",
			       message);
	}
}

static sqlite3_stmt *cached(struct store *store, const char *text)
{
	for (int i = 0; i < store->statement_count; i++)
		if (store->statements[i].text == text)
			return store->statements[i].statement;
	return NULL;
}

struct sql sql_query(struct store *store, const char *text)
{
	struct sql q = {.store = store, .statement = cached(store, text)};
	if (q.statement) {
		assert(!sqlite3_stmt_busy(q.statement));
		return q;
	}
	if (store->statement_count == SQL_STATEMENTS_MAX) {
		q.code = SQLITE_INTERNAL;
		return q;
	}
	q.code = sqlite3_prepare_v3(store->db, text, -1, SQLITE_PREPARE_PERSISTENT, &q.statement, NULL);
	if (q.code == SQLITE_OK) {
		store->statements[store->statement_count].text = text;
		store->statements[store->statement_count++].statement = q.statement;
	}
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
	enum tw_status status = q->code == SQLITE_OK ? TW_OK : sql_fail(q->store->db, q->code, error);
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
		*changed = q->code == SQLITE_OK ? sqlite3_changes64(q->store->db) : 0;
	return sql_end(q, error);
}

static enum tw_status read_number(struct store *store, const char *text, uint64_t *number, struct tw_error *error)
{
	struct sql q = sql_query(store, text);
	*number = sql_step(&q) ? (uint64_t)sql_int(&q) : 0;
	return sql_end(&q, error);
}

/* Everything is written twice, into the log and from there into the database, which has free pages of its own; and a
 * log that cannot be emptied into a full database can take no more, not even what would make room. So a quarter of the
 * reserve is for the log alone. */
enum tw_status sql_check_room(struct store *store, uint64_t bytes, struct tw_error *error)
{
	struct statvfs disk;
	uint64_t pages, page_bytes;
	const char *path = sqlite3_db_filename(store->db, "main");
	if (!path || !*path || statvfs(path, &disk))
		return TW_OK;
	enum tw_status status = read_number(store, "PRAGMA freelist_count", &pages, error);
	if (status == TW_OK)
		status = read_number(store, "PRAGMA page_size", &page_bytes, error);
	if (status != TW_OK)
		return status;
	uint64_t on_disk = (uint64_t)disk.f_bavail * disk.f_frsize, in_all = on_disk + pages * page_bytes;
	uint64_t for_log = store->reserve_bytes / 4;
	bool log_fits = on_disk >= for_log && on_disk - for_log >= bytes;
	bool both_fit = in_all >= store->reserve_bytes && (in_all - store->reserve_bytes) / 2 >= bytes;
	return log_fits && both_fit ? TW_OK : fail_full(error);
}

static enum tw_status execute(struct store *store, const char *text, struct tw_error *error)
{
	struct sql q = sql_query(store, text);
	return sql_run(&q, NULL, error);
}

enum tw_status transaction_begin(struct store *store, bool durable, struct tw_error *error)
{
	if (store->durable != durable) {
		int code =
			sqlite3_exec(store->db, durable ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL",
				     NULL, NULL, NULL);
		if (code != SQLITE_OK)
			return sql_fail(store->db, code, error);
		store->durable = durable;
	}
	return execute(store, "BEGIN IMMEDIATE", error);
}

enum tw_status snapshot_begin(struct store *store, struct tw_error *error)
{
	return execute(store, "BEGIN", error);
}

enum tw_status transaction_end(struct store *store, enum tw_status status, struct tw_error *error)
{
	if (status == TW_OK)
		status = execute(store, "COMMIT", error);
	/* SQLite has rolled back by itself after some errors (a full disk, say), and after others not. */
	if (status != TW_OK && !sqlite3_get_autocommit(store->db)) {
		enum tw_status ignored = execute(store, "ROLLBACK", NULL);
		(void)ignored;
	}
	return status;
}
