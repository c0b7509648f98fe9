/* The pulse of a worker: a thread that keeps the lease of the running job alive, tells its progress, and learns whether
 * it should stop. It has its own connection to the store, so that the computation never waits for the store.
 *
 * One pulse serves a worker for its whole life: begin and end around each job. The functions may be called from the
 * worker's thread only. */
#ifndef SERVICE_WORKER_PULSE_H
#define SERVICE_WORKER_PULSE_H

#include "storage/queue.h"

#include <stdbool.h>

struct pulse;

struct pulse_settings {
	const char *store_url;
	/* A computation that neither tells nor asks anything for so long hangs, and the process exits with
	 * PULSE_STALLED, so that its job goes to another and somebody starts it anew; 0: never. */
	int64_t stall_ms;
	/* Pipe, non-blocking: a byte says that some running job was asked to stop, so that the thread looks at once
	 * whether it is this one, and not at its next beat; -1 for none. */
	int asked_fd;
};

/* Opens the store and starts the thread. */
enum { PULSE_STALLED = 70 };
enum tw_status pulse_new(struct pulse **pulse, const struct pulse_settings *settings,
			 struct tw_error *error) TW_NODISCARD;
void pulse_free(struct pulse *pulse); /* NULL is allowed */

void pulse_begin(struct pulse *pulse, const struct job_ticket *ticket);

/* `share` 0…1; `stage` static or NULL: unchanged; `partial` JSON, copied, or NULL: unchanged. Cheap: what comes more
 * often than the thread beats is overwritten. */
void pulse_tell(struct pulse *pulse, double share, const char *stage, const char *partial);

/* The job was cancelled, or its lease was lost to another worker: its result is not wanted. */
bool pulse_says_stop(struct pulse *pulse);

/* The job was cancelled by somebody. */
bool pulse_says_cancelled(struct pulse *pulse);

/* Waits for a heartbeat under way; after it none is sent. */
void pulse_end(struct pulse *pulse);

#endif
