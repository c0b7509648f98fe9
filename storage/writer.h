/* The one writer of a process: the connection that all its transactions are written through, one after the other, in
 * the order in which they were begun. Internal to this folder; see transaction_begin in sql.h.
 *
 *     begin ──► [first come, first served] ──► SAVEPOINT … RELEASE ──► COMMIT ──► disk ──► end
 *                                              └ next: SAVEPOINT … ┘   └ of the group ┘
 *
 * Transactions that wait for each other are one group: one passage through the gate (gate.h), one BEGIN IMMEDIATE and
 * COMMIT, one wait for the disk. Each has a savepoint of its own, so one that fails is rolled back alone, and none is
 * told that it has succeeded before the group is committed and, where it asked for that, on the disk.
 *
 * Nobody waits for the disk with the write lock in his hands. So others may read what is committed some milliseconds
 * before it is on the disk; who is told that his own transaction is kept, is told so after.
 *
 * The log is copied into the database by a thread of its own, when it has grown: nobody's transaction pays for that. */
#ifndef STORAGE_WRITER_H
#define STORAGE_WRITER_H

#include "storage/connection.h"

#include <stdbool.h>

struct writer;

/* The writer of this process for a database, which exists and is set up; `path` as the caller names it. Every user
 * closes what it has opened; the last one ends it. Those with another limit have another writer. */
enum tw_status writer_open(struct writer **writer, const char *path, uint64_t limit_bytes,
			   struct tw_error *error) TW_NODISCARD;
void writer_close(struct writer *writer); /* NULL is allowed */

/* Waits for the turn and begins; `alone` in a group of its own, without a savepoint. Between the two calls the
 * connection is this thread's. TW_ERROR_IO "store-busy" | "store-gone". */
enum tw_status writer_begin(struct writer *writer, bool alone, struct connection **connection,
			    struct tw_error *error) TW_NODISCARD;

/* Keeps what was written where `status` is TW_OK, else rolls it back. Returns `status`, or why it could not be kept: a
 * full disk may take the whole group with it. With `durable` it is on the disk then. */
enum tw_status writer_end(struct writer *writer, enum tw_status status, bool durable,
			  struct tw_error *error) TW_NODISCARD;

/* The file, as the system tells files apart. */
void writer_place(const struct writer *writer, uint64_t *device, uint64_t *file);

/* Since it was opened. */
struct writer_counts {
	uint64_t transactions, groups, syncs;
};
void writer_count(struct writer *writer, struct writer_counts *counts);

#endif
