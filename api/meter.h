/* How much each key asks for: its requests are counted, for the store to know of, and held to the key's limits. Any
 * thread may call. */
#ifndef API_METER_H
#define API_METER_H

#include "storage/access.h"

struct meter;

struct meter *meter_new(void); /* NULL when out of memory */
void meter_free(struct meter *meter);

/* A request of the key at `now_ms`, of an even clock. TW_ERROR_LIMIT "limit-requests-per-second" |
 * "limit-requests-per-minute", and then *retry_s is when it would be let through. Each limit is a bucket that holds as
 * many requests as the limit allows in its time and fills evenly: a pause is made up for, once. */
enum tw_status meter_take(struct meter *meter, const struct access_key *key, int64_t now_ms, unsigned *retry_s,
			  struct tw_error *error) TW_NODISCARD;

/* The uses since the last call, as heap memory, to be freed; only of keys that the store has. `now_ms` as above,
 * `wall_ms` since 1970. Keys that have asked for nothing for a minute are forgotten, because by then their buckets are
 * full again: so memory is bounded by the keys in use. */
enum tw_status meter_drain(struct meter *meter, int64_t now_ms, int64_t wall_ms, struct access_use **uses,
			   size_t *count, struct tw_error *error) TW_NODISCARD;

#endif
