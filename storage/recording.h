/* The bench rig in the store: its state, its latest sample, and the samples of recordings. Written by the rig process,
 * read by the api. */
#ifndef STORAGE_RECORDING_H
#define STORAGE_RECORDING_H

#include "storage/job.h"

#define RIG_CHANNELS 24

struct rig_sample {
	int64_t at_us;                 /* since 1970, when the box answered */
	uint16_t counts[RIG_CHANNELS]; /* 0…1023 */
};

struct rig_state {
	char device[128]; /* "tcp://10.0.0.7:502"; "" before a rig process was ever started */
	char status[32];  /* "connected" "connecting" "stopped" */
	char text[256];   /* the last error, "" when all is well */
	int64_t updated_ms;
	bool has_sample;
	struct rig_sample latest;
};

/* Replaces the state; cheap (not durable), for a few times a second. */
enum tw_status rig_put(struct store *store, const struct rig_state *state, struct tw_error *error) TW_NODISCARD;
enum tw_status rig_get(struct store *store, struct rig_state *state, struct tw_error *error) TW_NODISCARD;

/* Appends samples to the recording that `ticket` is making, durably, and renews the lease; `*cancel` as in
 * job_heartbeat. Time stamps grow. TW_ERROR_CONFLICT "lease-lost", and then nothing is written. */
enum tw_status recording_append(struct store *store, const struct job_ticket *ticket, const struct rig_sample *samples,
				size_t count, double progress, bool *cancel, struct tw_error *error) TW_NODISCARD;

/* At most `limit` samples of a recording from sample number `first`; fewer only at its end. `*got` 0: no more. */
enum tw_status recording_read(struct store *store, const char *resource_id, uint64_t first, struct rig_sample *samples,
			      size_t limit, size_t *got, struct tw_error *error) TW_NODISCARD;

/* How many samples there are, and the time stamps of the first and the last (0 when there are none). */
struct recording_extent {
	uint64_t sample_count;
	int64_t first_us, last_us;
};
enum tw_status recording_extent(struct store *store, const char *resource_id, struct recording_extent *extent,
				struct tw_error *error) TW_NODISCARD;

#endif
