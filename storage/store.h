/* The store: one SQLite database that keeps every upload, resource, result and job. This folder holds the only SQL.
 *
 * One `struct store` is one connection for reading, and may be used by one thread at a time; threads and processes that
 * work side by side open their own on the same URL. What the stores of a process write goes through one connection
 * more, first come, first served, many transactions at once (writer.h); the processes take turns (gate.h). Reads wait
 * for nobody.
 *
 * Every function that writes is one transaction of its own: after an error nothing of it is kept. What a client is told
 * has happened is on the disk before the function returns; upload chunks, claims and heartbeats are written without
 * waiting for the disk, because a later durable transaction carries them with it and losing them costs only a
 * repetition. A read may see what others have written a few milliseconds before it is on the disk.
 *
 * Errors of every function here, besides those that it names: TW_ERROR_FULL "store-full" (disk, quota or file size
 * limit), TW_ERROR_IO "store-io" | "store-busy" (the others did not let it write for ten seconds) |
 * "store-gone" (the file was deleted, replaced or unmounted) | "store-damaged", TW_ERROR_MEMORY. */
#ifndef STORAGE_STORE_H
#define STORAGE_STORE_H

#include "tightwire.h"

#include <stdbool.h>

struct store;

/* Ids are text: a word for the kind, "_", 26 letters and digits. Opaque to clients, safe in a URL and in a file name.
 */
#define STORE_ID_SIZE 40

/* `url`: "sqlite:PATH", optionally followed by "?" and, joined by "&", "limit_bytes=N", the size at which the database
 * counts as full, and "reserve_bytes=N", what is left free on the disk (32 MiB unless told otherwise): a disk that is
 * full to the last byte could not even be told what to delete. Creates the database where there is none and migrates an
 * older one. TW_ERROR_INPUT "store-url" for an URL that is not understood, "store-foreign" for a database of another
 * program; TW_ERROR_UNSUPPORTED "store-newer" for one that a newer tightwire has written. */
enum tw_status store_open(struct store **store, const char *url, struct tw_error *error) TW_NODISCARD;

/* The same, but TW_ERROR_NOT_FOUND "no-such-store" where there is none. */
enum tw_status store_open_existing(struct store **store, const char *url, struct tw_error *error) TW_NODISCARD;

void store_close(struct store *store); /* NULL is allowed */

/* Milliseconds since 1970 by the machine's clock, which every time stamp is taken from. */
int64_t store_now_ms(const struct store *store);

/* Milliseconds by the clock that leases and pauses are measured by: whatever the machine's clock is set to, it goes on
 * evenly (CLOCK_BOOTTIME), and after a new start of the machine it stands far beyond all that it showed before. */
int64_t store_lease_now_ms(const struct store *store);

/* Whether the lease clock showed this before the machine's last start. */
bool store_is_of_older_boot(const struct store *store, int64_t lease_ms);

/* Tests set their own; it takes the place of both clocks. */
void store_set_clock(struct store *store, int64_t (*now_ms)(void *context), void *context);

/* How many bytes results and uploads may still take before the store counts as full. */
enum tw_status store_room(struct store *store, uint64_t *bytes, struct tw_error *error) TW_NODISCARD;

/* Returns some of the free pages to the file system. For the daemon to call every minute or so. */
enum tw_status store_shrink(struct store *store, struct tw_error *error) TW_NODISCARD;

/* Which file it is: equal for two stores that were opened on the same. */
struct store_place {
	uint64_t device, file;
};
struct store_place store_place(const struct store *store);

/* Whether the store's file is still at its path: TW_ERROR_IO "store-gone". */
enum tw_status store_check_place(struct store *store, struct tw_error *error) TW_NODISCARD;
#define STORE_GONE "store-gone"

/* A cheap read that fails when the store cannot answer; for readiness. */
enum tw_status store_ping(struct store *store, struct tw_error *error) TW_NODISCARD;

/* What this process has written since it opened the store: how many transactions, in how many groups that were
 * committed at once, and how many times it waited for the disk. */
struct store_writes {
	uint64_t transactions, groups, syncs;
};
void store_count_writes(struct store *store, struct store_writes *writes);

/* A consistent copy of the whole store into a new file `path`, while others go on reading and writing.
 * TW_ERROR_CONFLICT "backup-exists" when the file is there already. */
enum tw_status store_backup(struct store *store, const char *path, struct tw_error *error) TW_NODISCARD;

#endif
