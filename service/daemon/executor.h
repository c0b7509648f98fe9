/* A few threads for steps that may have to wait for the store's writer, so that the threads that serve connections wait
 * for nothing. Those that wait at the same time are committed together (storage/writer.h): as many as there are threads
 * here share one wait for the disk. */
#ifndef SERVICE_DAEMON_EXECUTOR_H
#define SERVICE_DAEMON_EXECUTOR_H

#include "tightwire.h"

struct executor;

/* Embedded in what it works on; the executor's from executor_run until `run` is called. */
struct task {
	void (*run)(struct task *task);
	struct task *next;
};

enum tw_status executor_new(struct executor **executor, unsigned threads, struct tw_error *error) TW_NODISCARD;

/* Runs the tasks in the order in which they come, as many at once as there are threads. From any thread. */
void executor_run(struct executor *executor, struct task *task);

/* Runs what has come, and ends the threads. NULL is allowed. */
void executor_free(struct executor *executor);

#endif
