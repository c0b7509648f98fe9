/* Cleaning up behind deletions and uploads that nobody finished. */
#ifndef STORAGE_SWEEP_H
#define STORAGE_SWEEP_H

#include "storage/store.h"

/* A step of cleaning up: removes a little of what was deleted, and of uploads that nobody sealed or used for
 * `upload_age_ms`. *more: there is more of it. Where there is nothing, a cheap read. For the daemon to call again and
 * again, because what is deleted is only out of sight until then. */
enum tw_status store_sweep(struct store *store, int64_t upload_age_ms, bool *more, struct tw_error *error) TW_NODISCARD;

#endif
