/* The bench rig in the store: its state, its latest sample, and the samples of recordings. Written by the rig process,
 * read by the api. */
#ifndef STORAGE_RECORDING_H
#define STORAGE_RECORDING_H

#include "storage/job.h"

#define RIG_CHANNELS 24

struct rig_sample {
	int64_t at_us;                 /* since 1970, when the box answered; see recording_course */
	uint16_t counts[RIG_CHANNELS]; /* 0…1023 */
};

/* Since the rig process started. */
struct rig_counts {
	uint64_t scans;      /* slots that gave a sample */
	uint64_t gaps;       /* slots that gave none */
	uint64_t exceptions; /* Modbus exceptions among the gaps */
	uint64_t dropped;    /* samples that were lost on the way to the store */
	uint64_t connects;   /* times a connection was made */
};

struct rig_state {
	char device[128]; /* "tcp://10.0.0.7:502"; "" before a rig process was ever started */
	char status[32];  /* "connected" "connecting" "stopped" */
	char text[256];   /* the last error, "" when all is well */
	uint32_t rate_hz; /* slots a second */
	struct rig_counts counts;
	int64_t updated_ms;
	bool has_sample;
	struct rig_sample latest;
};

/* Replaces the state; cheap (not durable), for a few times a second. */
enum tw_status rig_put(struct store *store, const struct rig_state *state, struct tw_error *error) TW_NODISCARD;
enum tw_status rig_get(struct store *store, struct rig_state *state, struct tw_error *error) TW_NODISCARD;

/* How a recording goes, kept from its first slot to its end so that another process can go on with it. A slot is a
 * period of the rig's rate by CLOCK_BOOTTIME, numbered from boot; the wall clock only labels. */
struct recording_course {
	char boot[40]; /* the kernel's id of the boot that numbers the slots */
	uint32_t rate_hz;
	int64_t first_slot;
	int64_t slot_count;  /* asked for */
	int64_t start_us;    /* since 1970: the wall clock's label of the first slot */
	int64_t last_slot;   /* of the last sample; first_slot - 1 before there is any */
	int64_t longest_gap; /* slots without a sample in a row, up to last_slot */
	uint64_t exceptions; /* slots that the device answered with a Modbus exception */
	uint64_t dropped;    /* samples that were lost on the way to the store */
};

/* Takes `course` as that of the recording that `ticket` makes; or, where an earlier process had begun it, gives that
 * one's course as it was appended last, and *resumed = true. Durable. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status recording_begin(struct store *store, const struct job_ticket *ticket, struct recording_course *course,
			       bool *resumed, struct tw_error *error) TW_NODISCARD;

/* The course of a recording that has begun and not ended; *found = false for any other. */
enum tw_status recording_find_course(struct store *store, const char *resource_id, struct recording_course *course,
				     bool *found, struct tw_error *error) TW_NODISCARD;

/* The recordings that have begun and not ended, oldest first, at most `limit` ids. */
enum tw_status recording_list_begun(struct store *store, char (*resource_ids)[STORE_ID_SIZE], size_t limit,
				    size_t *count, struct tw_error *error) TW_NODISCARD;

/* Appends samples to the recording that `ticket` is making, with its course up to them, durably, and renews the lease;
 * `*cancel` as in job_heartbeat. Time stamps grow. TW_ERROR_CONFLICT "lease-lost", and then nothing is written. */
enum tw_status recording_append(struct store *store, const struct job_ticket *ticket, const struct rig_sample *samples,
				size_t count, const struct recording_course *course, double progress, bool *cancel,
				struct tw_error *error) TW_NODISCARD;

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
