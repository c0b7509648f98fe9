/* What is done to many jobs at once: redriving what failed in the night because a disk was full, say, or cancelling a
 * batch. */
#ifndef STORAGE_BULK_H
#define STORAGE_BULK_H

#include "storage/jobs.h"

enum bulk_action {
	BULK_REDRIVE, /* failed and cancelled jobs */
	BULK_CANCEL,  /* queued and running jobs */
};

/* The states of jobs that the action can be applied to, 1u << state… */
unsigned bulk_states(enum bulk_action action);

/* How far one has come; zero at first. */
struct bulk_progress {
	enum job_state state; /* those in states before this one have all been looked at */
	int64_t last;         /* number of the job that was looked at last */
	uint64_t changed;     /* redriven, or cancelled or asked to stop */
	bool done;
};

/* A step: does it to some dozens of the jobs that the query finds, oldest first, in a transaction of its own, so that
 * others can write between two steps however many there are. `query`: its cursor and limit do not count; its states are
 * of bulk_states(action), 0 for all of these.
 *
 * A redriven job goes back with fresh attempts, together with those failed or cancelled jobs whose resources it needs;
 * these are not counted. It is redriven once, also when it fails again meanwhile. */
enum tw_status bulk_step(struct store *store, enum bulk_action action, const struct job_query *query,
			 struct bulk_progress *progress, struct tw_error *error) TW_NODISCARD;

#endif
