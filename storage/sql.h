/* SQLite without the noise, for the files of this folder: cached statements that are bound and read in order, errors
 * that stick until the end, and transactions that end well or not at all.
 *
 *     struct sql q = sql_query(store, "SELECT id, size FROM blob WHERE number = ?");
 *     sql_bind_int(&q, number);
 *     while (sql_step(&q))
 *             use(sql_text(&q), sql_int(&q));
 *     return sql_end(&q, error);
 */
#ifndef STORAGE_SQL_H
#define STORAGE_SQL_H

#include "storage/connection.h"
#include "tightwire.h"

#include <stdbool.h>

struct writer;

struct store {
	struct connection reads;
	struct writer *writer;            /* owned, shared by all stores of the process */
	struct connection *connection;    /* what statements go through: `reads`, within a transaction the writer's */
	bool durable;                     /* the transaction that is under way; see transaction_begin */
	int64_t (*now_ms)(void *context); /* of a test; NULL: the machine's clocks */
	void *clock_context;
	int64_t boot;           /* which start of the machine this is; see store_lease_now_ms */
	int64_t trouble_ms;     /* CLOCK_BOOTTIME, when a transaction failed because of the disk last; 0: never */
	uint64_t reserve_bytes; /* left free on the disk */
	bool found_work;        /* by the last claim; see queue.c */
};

struct sql {
	struct store *store;
	sqlite3_stmt *statement; /* NULL where preparing failed */
	int code;                /* the first SQLite error, or SQLITE_OK */
	int cause;               /* errno of it */
	int bound;               /* parameters bound so far */
	int column;              /* next column to read */
};

/* `text` must be a literal. */
struct sql sql_query(struct store *store, const char *text);

void sql_bind_int(struct sql *q, int64_t value);
void sql_bind_real(struct sql *q, double value);
void sql_bind_text(struct sql *q, const char *text);                  /* borrowed until sql_end; NULL binds NULL */
void sql_bind_bytes(struct sql *q, const void *bytes, uint64_t size); /* borrowed until sql_end */

/* True when there is a row; false at the end and after an error. */
bool sql_step(struct sql *q);

/* The next column of the row. Text and bytes are borrowed until the next step; text may be NULL. */
bool sql_is_null(const struct sql *q); /* of the next column, which stays the next */
int64_t sql_int(struct sql *q);
double sql_real(struct sql *q);
const char *sql_text(struct sql *q);
const void *sql_bytes(struct sql *q, size_t *size);
void sql_copy_text(struct sql *q, char *out, size_t size); /* cut to size; NULL gives "" */
char *sql_own_text(struct sql *q);                         /* heap; NULL stays NULL, sets SQLITE_NOMEM */

/* Resets the statement and tells the first error. */
enum tw_status sql_end(struct sql *q, struct tw_error *error) TW_NODISCARD;

/* Steps to the end, ends, and tells how many rows were changed (`changed` may be NULL). */
enum tw_status sql_run(struct sql *q, int64_t *changed, struct tw_error *error) TW_NODISCARD;

/* The number of the row that was inserted last in this transaction. */
int64_t sql_inserted(const struct store *store);

/* Waits for the process's one writer (writer.h). `durable`: on the disk when transaction_end returns. No transaction
 * may be begun within another of the same thread, also not on another store. */
enum tw_status transaction_begin(struct store *store, bool durable, struct tw_error *error) TW_NODISCARD;

/* The same, not durable, for what writes or removes a lot: it shares its commit with no other, which would have to wait
 * for it and could be lost with it when the disk is full. (And SQLite would write pages that become free within a
 * savepoint.) */
enum tw_status transaction_begin_alone(struct store *store, struct tw_error *error) TW_NODISCARD;

/* Fails with "store-full" where `bytes` more would take of the reserve. For what adds to the store: what removes from
 * it, or ends a job, must go on then, and lives on the reserve. */
enum tw_status sql_check_room(struct store *store, uint64_t bytes, struct tw_error *error) TW_NODISCARD;

/* How many bytes could be added. */
enum tw_status sql_room(struct store *store, uint64_t *bytes, struct tw_error *error) TW_NODISCARD;

/* Whether a transaction of this store failed because of the disk within the last minute: others' may have too. */
bool sql_had_trouble(const struct store *store);

/* For reads that belong together. */
enum tw_status snapshot_begin(struct store *store, struct tw_error *error) TW_NODISCARD;

/* Commits where `status` is TW_OK, else rolls back; ends a snapshot too. Returns `status`, or why the commit failed. */
enum tw_status transaction_end(struct store *store, enum tw_status status, struct tw_error *error) TW_NODISCARD;

#endif
