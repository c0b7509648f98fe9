/* Removing resources, inside the transaction that the caller has begun. Internal to this folder. */
#ifndef STORAGE_REMOVE_H
#define STORAGE_REMOVE_H

#include "storage/store.h"

/* The resource with this number and all that is made from it, directly or not, with their jobs; their blobs are let go
 * of (chunk.h). */
enum tw_status resource_remove(struct store *store, int64_t resource, struct tw_error *error) TW_NODISCARD;

#endif
