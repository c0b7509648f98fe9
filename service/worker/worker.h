/* A worker: claims a job, computes it, stores the result, and takes the next. It holds nothing that matters: a worker
 * that dies leaves a lease that runs out. */
#ifndef SERVICE_WORKER_WORKER_H
#define SERVICE_WORKER_WORKER_H

#include "tightwire.h"

#include <stdbool.h>
#include <sys/types.h>

struct store;

/* "worker-PID-NAMESPACE": what a worker is called in its jobs' rows where it is given no name. The namespace is that of
 * the process ids, which on a machine without containers is always the same. */
enum { WORKER_NAME_SIZE = 64 };
void worker_name(char name[WORKER_NAME_SIZE], pid_t pid);

/* Takes back what workers with such names hold whose process is gone: what a crash of everything left behind need not
 * wait for its lease, and costs no attempt. Those of other namespaces, who cannot be seen, are left alone. */
enum tw_status worker_abandon_dead(struct store *store, struct tw_error *error) TW_NODISCARD;

struct worker_settings {
	const char *store_url;
	const char *name; /* in the job's row; NULL for worker_name, by which the supervisor knows it */
	int wake_fd; /* pipe: a byte says there may be work, the end of file that the supervisor is gone; -1 for none */
	int done_fd; /* pipe that gets a byte when a job has ended; -1 for none */
	int asked_fd; /* pipe of this worker alone: a byte says that a running job was asked to stop; -1 for none */
	bool interactive_only; /* takes interactive jobs, and leaves all others */
	unsigned threads;      /* of one computation */
	size_t memory_limit;   /* bytes that jobs, searches and what is kept between jobs may take; 0 for none */
	int64_t lease_ms;
	int64_t stall_ms; /* a computation that is silent for so long hangs, and the process exits; 0: never */
};

/* Works until SIGTERM or SIGINT: the first lets the running job end, the second gives it back to the queue. Returns
 * TW_OK then. Returns an error only when the store cannot be opened or is not there any more ("store-gone"); other
 * errors are logged and tried again. */
enum tw_status worker_run(const struct worker_settings *settings, struct tw_error *error) TW_NODISCARD;

#endif
