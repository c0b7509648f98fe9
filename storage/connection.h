/* One connection to the SQLite file, with its prepared statements. Internal to this folder. Used by one thread at a
 * time; which one may change. */
#ifndef STORAGE_CONNECTION_H
#define STORAGE_CONNECTION_H

#include "tightwire.h"

#include <sqlite3.h>
#include <stdint.h>

enum {
	CONNECTION_STATEMENTS_MAX = 384,
	CONNECTION_SLOTS = 1024, /* a power of 2 */
	CONNECTION_PAGE_BYTES = 8192,
	CONNECTION_BUSY_MS = 10000, /* how long a write waits for the others before it is "store-busy" */
};

struct connection {
	sqlite3 *db; /* owned */
	/* Prepared statements, and where each stands (1 for the first) by the address of its text, which is a literal.
	 */
	struct {
		const char *text;
		sqlite3_stmt *statement;
	} statements[CONNECTION_STATEMENTS_MAX];
	int statement_count;
	uint16_t slots[CONNECTION_SLOTS];
};

/* Opens the file, and creates it where it is not there. Whose it is, has to be looked at before connection_set_up.
 * `connection` is all zero before, and has to be closed after an error too. TW_ERROR_IO "store-io". */
enum tw_status connection_open(struct connection *connection, const char *path, struct tw_error *error) TW_NODISCARD;

/* Write-ahead log, page size and what else every connection has. `limit_bytes`: the size at which the database counts
 * as full; 0: none. */
enum tw_status connection_set_up(struct connection *connection, uint64_t limit_bytes,
				 struct tw_error *error) TW_NODISCARD;

void connection_close(struct connection *connection);

/* The statement with this text, prepared when it is first asked for. Returns a SQLite code. */
int connection_prepare(struct connection *connection, const char *text, sqlite3_stmt **statement);

/* Runs a statement that has no parameters and gives no rows of interest. Returns a SQLite code; errno of a failure is
 * left as SQLite left it. */
int connection_run(struct connection *connection, const char *text);

/* What a SQLite code means to the callers of this folder; errno must still be as SQLite left it. */
enum tw_status connection_fail(sqlite3 *db, int code, struct tw_error *error);

/* The failure of every write to a full store. */
enum tw_status connection_fail_full(struct tw_error *error);

/* Whether the file is not at its path any more: deleted, replaced, or its file system unmounted. SQLite would go on
 * with what nobody can find again. */
enum tw_status connection_check_place(struct connection *connection, struct tw_error *error) TW_NODISCARD;

#endif
