/* What the clock brings: leases and pauses by the lease clock, deadlines and jobs that were to begin later by the
 * machine's, which goes on where it was after a new start. Internal to this folder. */
#ifndef STORAGE_DUE_H
#define STORAGE_DUE_H

#include "storage/store.h"

/* Whether something is due. Takes no lock. */
enum tw_status due_any(struct store *store, bool *due, struct tw_error *error) TW_NODISCARD;

/* Milliseconds until something is: 0 where it is now, -1 where nothing is awaited. */
enum tw_status due_next(struct store *store, int64_t *wait_ms, struct tw_error *error) TW_NODISCARD;

/* Within a transaction: a bounded number of steps; *more where there may be others. */
enum tw_status due_end(struct store *store, bool *more, struct tw_error *error) TW_NODISCARD;

/* Only the leases, and all of them: they are as many as there are workers. */
enum tw_status due_expire_leases(struct store *store, struct tw_error *error) TW_NODISCARD;

#endif
