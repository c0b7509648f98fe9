/* The worker processes of the daemon: N of `tightwire worker`, replaced when they end, with a pause that doubles while
 * they keep dying.
 *
 * Pipes join them to the daemon. A byte in a wake pipe, of which those that are kept for interactive jobs have one of
 * their own, wakes one idle worker; its end of file tells the workers that the daemon is gone. A byte in the done pipe
 * tells the daemon that a job has ended. Every worker has a pipe of its own besides: a byte says that a running job,
 * its own perhaps, was asked to stop. All are hints: workers and daemon also look into the store by themselves. */
#ifndef SERVICE_DAEMON_SUPERVISOR_H
#define SERVICE_DAEMON_SUPERVISOR_H

#include "service/daemon/metrics.h"
#include "tightwire.h"

#include <stdbool.h>
#include <sys/types.h>

struct supervisor;

struct supervisor_settings {
	const char *program;     /* what is executed: "/proc/self/exe" */
	const char *store_url;   /* all borrowed */
	struct metrics *metrics; /* may be NULL */
	unsigned workers;
	unsigned interactive_workers; /* of these, that take interactive jobs only */
	unsigned threads;             /* these three are handed to every worker: service/worker.h */
	uint64_t memory_mib;
	unsigned lease_s;
	/* A worker is dead: its job need not wait for its lease. `crashed`: it died by itself, while nobody asked it to
	 * end. May be NULL. */
	void (*ended)(void *context, pid_t pid, bool crashed);
	void *context; /* borrowed, handed to it */
};

/* Starts the workers. The signal mask of the workers is empty whatever the caller's is. */
enum tw_status supervisor_start(struct supervisor **supervisor, const struct supervisor_settings *settings,
				struct tw_error *error) TW_NODISCARD;

/* Wakes an idle worker, and where there may be interactive work, one more of those that do nothing else. May be called
 * from any thread. */
void supervisor_wake(struct supervisor *supervisor, bool is_interactive);

/* Tells all workers that a running job was asked to stop, or was removed. May be called from any thread. */
void supervisor_tell_asked(struct supervisor *supervisor);

/* For poll: readable when a job has ended. supervisor_take_done then empties it. */
int supervisor_done_fd(const struct supervisor *supervisor);
bool supervisor_take_done(struct supervisor *supervisor);

/* To be called on SIGCHLD and a few times a second: takes note of workers that ended, starts those that are due. */
void supervisor_tick(struct supervisor *supervisor);

/* Asks all workers to end and starts no more: the first call lets running jobs end, the second gives them back to the
 * queue. supervisor_alive counts the workers that are still there. */
void supervisor_drain(struct supervisor *supervisor);
unsigned supervisor_alive(const struct supervisor *supervisor);

/* Kills what is left, and frees. NULL is allowed. */
void supervisor_stop(struct supervisor *supervisor);

#endif
