/* Redriving in bulk: what failed in the night because a disk was full, say. */
#ifndef STORAGE_REDRIVE_H
#define STORAGE_REDRIVE_H

#include "storage/job.h"
#include "storage/tenant.h"

struct redrive_query {
	int64_t tenant;           /* not TENANT_ANY */
	unsigned kinds;           /* JOB_KIND_BIT…; 0 for all */
	enum job_state state;     /* JOB_FAILED or JOB_CANCELLED */
	const char *failure_type; /* only those that failed with it, "store-full"; NULL for all */
};

/* How far one has come; zero at first. */
struct redrive_progress {
	int64_t last; /* number of the job that was looked at last */
	uint64_t redriven;
	bool done;
};

/* A step: redrives some dozens of the jobs that the query finds, oldest first, in a transaction of its own, so that
 * others can write between two steps however many there are. Each goes back with fresh attempts, together with those
 * failed or cancelled jobs whose resources it needs; these are not counted. A job is redriven once, also when it fails
 * again meanwhile. */
enum tw_status redrive_step(struct store *store, const struct redrive_query *query, struct redrive_progress *progress,
			    struct tw_error *error) TW_NODISCARD;

#endif
