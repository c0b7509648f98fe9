/* What a worker wants to do next. */
#ifndef STORAGE_CLAIM_H
#define STORAGE_CLAIM_H

#include "storage/job_request.h"

#include <stddef.h>

/* All borrowed. */
struct claim_query {
	unsigned kinds;   /* JOB_KIND_BIT… */
	unsigned classes; /* JOB_CLASS_BIT…; 0 for all: a worker that is kept for designers claims interactive ones only
			   */
	const char *worker;
	int64_t lease_ms;
	/* What it has in memory (job_affinity): within a lane such a job is preferred to others of the same priority,
	 * if it is among the first PICK_WINDOW; and no job is passed over so more than PICK_PREFERRED_MAX times. */
	const int64_t *affinities;
	size_t affinity_count;
};

enum {
	PICK_WINDOW = 16,
	PICK_PREFERRED_MAX = 8,
	PICK_PASSES_MAX = 15, /* claims in a row that pass over a class that waits */
};

#endif
