/* Who waits for which jobs in this process: requests that are held, and streams of events. Whoever leaves learns
 * whether he was the last, and may then cancel the job if nobody wants it for good (storage: job_cancel_unwanted).
 *
 * A job that is wanted by waiters only counts the requests for it; a waiter knows the count at his time. Who leaves
 * last hands the highest that any of those knew who gave the job up to the store, which cancels only if no request has
 * come besides: one that has, and is not waiting yet, or has its answer and wants the job all the same, is safe. */
#ifndef API_WAITING_H
#define API_WAITING_H

#include "storage/store.h"

#include <stdbool.h>

struct waiting;

/* Embedded in what waits; all zero: it does not. */
struct waiter {
	char job_id[STORE_ID_SIZE];
	int64_t requests; /* as struct job has it */
	struct waiter *next, *previous;
	bool is_waiting;
};

struct waiting *waiting_new(void); /* NULL when out of memory */
void waiting_free(struct waiting *waiting);

/* From any thread. The waiter must stay where it is until it leaves. */
void waiting_join(struct waiting *waiting, struct waiter *waiter, const char *job_id, int64_t requests);

/* True when nobody else waits for the job: waiter->requests is then the highest that those knew who `gives_up` was true
 * of, and itself. One that does not wait was not the last. */
bool waiting_leave(struct waiting *waiting, struct waiter *waiter, bool gives_up);

#endif
