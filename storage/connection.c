/* How the database file is opened and kept.
 *
 * WAL, because readers (the daemon) must not wait for writers (the workers). Pages of 8 KiB, because most of the file
 * is chunks of a megabyte. Incremental vacuum, so that a deleted suit gives its space back without a stop. Deleted
 * pages are not overwritten with zeros, as Debian's SQLite does unless told otherwise: it would write a large upload
 * once more when it goes. synchronous=NORMAL, because writer.c itself waits for the disk, many transactions at once. */
#include "storage/connection.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <string.h>

enum { WAIT_FOR_WAL_MS = 5 };

/* A file size limit and a quota mean the same to a client as a full disk, but only ENOSPC is SQLITE_FULL. (errno
 * itself, because sqlite3_system_errno does not know of the errors of a COMMIT.) */
static bool is_full(int code, int cause)
{
	return code == SQLITE_FULL || (code == SQLITE_IOERR && (cause == EFBIG || cause == EDQUOT || cause == ENOSPC));
}

enum tw_status connection_fail_full(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_FULL, "store-full", NULL,
		       "the store is full; free space on its disk or delete resources, then try again");
}

enum tw_status connection_fail(sqlite3 *db, int code, struct tw_error *error)
{
	int cause = errno;
	int primary = code & 0xff;
	const char *message = db ? sqlite3_errmsg(db) : sqlite3_errstr(code);
	if (is_full(primary, cause))
		return connection_fail_full(error);
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
			       "the store is damaged (%s); restore it from a backup",
			       !strcmp(message, "not an error") ? sqlite3_errstr(code) : message);
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

enum tw_status connection_open(struct connection *connection, const char *path, struct tw_error *error)
{
	int code = sqlite3_open_v2(
		path, &connection->db,
		SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE, NULL);
	if (code != SQLITE_OK)
		return tw_fail(error, TW_ERROR_IO, "store-io", NULL, "the store %.200s cannot be opened: %s", path,
			       connection->db ? sqlite3_errmsg(connection->db) : sqlite3_errstr(code));
	sqlite3_busy_timeout(connection->db, CONNECTION_BUSY_MS);
	sqlite3_db_config(connection->db, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
	return TW_OK;
}

static int read_auto_vacuum(sqlite3 *db, int *mode)
{
	sqlite3_stmt *statement = NULL;
	int code = sqlite3_prepare_v2(db, "PRAGMA auto_vacuum", -1, &statement, NULL);
	if (code == SQLITE_OK)
		code = sqlite3_step(statement);
	*mode = code == SQLITE_ROW ? sqlite3_column_int(statement, 0) : 0;
	sqlite3_finalize(statement);
	return code == SQLITE_ROW || code == SQLITE_DONE ? SQLITE_OK : code;
}

/* What a file gets when it is made. Said again it would change nothing, but wait for the write lock. */
static int set_up_file(sqlite3 *db)
{
	enum { INCREMENTAL = 2 };
	char text[128];
	int mode = 0;
	int code = read_auto_vacuum(db, &mode);
	if (code != SQLITE_OK || mode == INCREMENTAL)
		return code;
	snprintf(text, sizeof text, "PRAGMA page_size = %d; PRAGMA auto_vacuum = INCREMENTAL", CONNECTION_PAGE_BYTES);
	return sqlite3_exec(db, text, NULL, NULL, NULL);
}

static int set_up_connection(sqlite3 *db, uint64_t limit_bytes)
{
	char text[512];
	snprintf(text, sizeof text,
		 "PRAGMA journal_mode = WAL;"
		 "PRAGMA secure_delete = FAST; PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF;"
		 "PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 0;"
		 "PRAGMA temp_store = MEMORY; PRAGMA cache_size = -4096; PRAGMA journal_size_limit = 67108864;"
		 "PRAGMA max_page_count = %" PRIu64,
		 limit_bytes ? limit_bytes / CONNECTION_PAGE_BYTES : UINT64_C(4294967294));
	return sqlite3_exec(db, text, NULL, NULL, NULL);
}

/* Turning a new database to WAL needs it exclusively, and SQLite does not wait for that by itself. */
enum tw_status connection_set_up(struct connection *connection, uint64_t limit_bytes, struct tw_error *error)
{
	int code = SQLITE_BUSY;
	for (int waited_ms = 0; code == SQLITE_BUSY && waited_ms < CONNECTION_BUSY_MS; waited_ms += WAIT_FOR_WAL_MS) {
		code = set_up_file(connection->db);
		if (code == SQLITE_OK)
			code = set_up_connection(connection->db, limit_bytes);
		if (code == SQLITE_BUSY)
			sqlite3_sleep(WAIT_FOR_WAL_MS);
	}
	return code == SQLITE_OK ? TW_OK : connection_fail(connection->db, code, error);
}

void connection_close(struct connection *connection)
{
	for (int i = 0; i < connection->statement_count; i++)
		sqlite3_finalize(connection->statements[i].statement);
	sqlite3_close(connection->db);
	connection->db = NULL;
	connection->statement_count = 0;
	memset(connection->slots, 0, sizeof connection->slots);
}

/* The slot of the text, or the free one that it is to have. */
static uint16_t *find_slot(struct connection *connection, const char *text)
{
	uint64_t hash = (uint64_t)(uintptr_t)text * 0x9e3779b97f4a7c15;
	for (size_t i = (size_t)(hash >> 32);; i++) {
		uint16_t *slot = &connection->slots[i % CONNECTION_SLOTS];
		if (*slot == 0 || connection->statements[*slot - 1].text == text)
			return slot;
	}
}

int connection_prepare(struct connection *connection, const char *text, sqlite3_stmt **statement)
{
	uint16_t *slot = find_slot(connection, text);
	if (*slot) {
		*statement = connection->statements[*slot - 1].statement;
		assert(!sqlite3_stmt_busy(*statement));
		return SQLITE_OK;
	}
	if (connection->statement_count == CONNECTION_STATEMENTS_MAX)
		return SQLITE_INTERNAL;
	int code = sqlite3_prepare_v3(connection->db, text, -1, SQLITE_PREPARE_PERSISTENT, statement, NULL);
	if (code == SQLITE_OK) {
		connection->statements[connection->statement_count].text = text;
		connection->statements[connection->statement_count++].statement = *statement;
		*slot = (uint16_t)connection->statement_count;
	}
	return code;
}

int connection_run(struct connection *connection, const char *text)
{
	sqlite3_stmt *statement = NULL;
	int code = connection_prepare(connection, text, &statement);
	if (code != SQLITE_OK)
		return code;
	do {
		errno = 0;
		code = sqlite3_step(statement);
	} while (code == SQLITE_ROW);
	int cause = errno;
	sqlite3_reset(statement);
	errno = cause;
	return code == SQLITE_DONE ? SQLITE_OK : code;
}

enum tw_status connection_check_place(struct connection *connection, struct tw_error *error)
{
	int moved = 0;
	int code = sqlite3_file_control(connection->db, "main", SQLITE_FCNTL_HAS_MOVED, &moved);
	if (code != SQLITE_OK || !moved)
		return TW_OK;
	return tw_fail(error, TW_ERROR_IO, "store-gone", NULL,
		       "the store %.200s was deleted, replaced or unmounted while it was open; restart what uses it",
		       sqlite3_db_filename(connection->db, "main"));
}
