/* What a job has to work with. A handler (job_*.c) reads the resource and what that is made from, calls the solver, and
 * leaves the result here; the worker stores it. Handlers write nothing themselves. */
#ifndef SERVICE_WORKER_WORK_H
#define SERVICE_WORKER_WORK_H

#include "service/worker/cache.h"
#include "service/worker/pulse.h"
#include "service/worker/warm_states.h"
#include "solver/arena.h"
#include "storage/resources.h"
#include "storage/result.h"

#include <jansson.h>

/* How the memory of a worker is shared out. The shares are fixed, whatever the others hold at the moment: an answer, or
 * that there is none for want of memory, never depends on what a cache happens to have. Bytes; 0: no limit. */
struct work_shares {
	size_t cache;  /* garment and field, which stay from job to job */
	size_t warm;   /* what the last drags left */
	size_t arena;  /* of the job: what it reads and its result */
	size_t search; /* of the job: scratch of the Steiner search, its linear program included */
};
struct work_shares work_shares_of(size_t limit, enum job_kind kind);

struct work {
	struct store *store; /* borrowed; the worker's connection */
	/* Borrowed; what is to be made, or, where the job makes no resource, what it works on; NULL: nothing. */
	const struct resource *resource;
	const char *argument; /* borrowed; what of that it makes; "" where the job's kind says all */
	struct cache *cache;  /* borrowed; the last garment and field */
	struct pulse *pulse;  /* borrowed */
	struct arena *arena;  /* borrowed; the result lies here */
	bool (*stop)(void);   /* the process was asked to stop at once */
	unsigned threads;
	size_t search_limit; /* bytes of scratch for a search; 0 for none */
	struct job_result result;

	struct warm_states *warm_states; /* borrowed; of the worker's drags */
	int64_t affinity;                /* of the job's drag; 0 where it is in none */
	/* What a handler leaves to be done when the job has ended and nobody waits for it: it may take long, and looks
	 * now and then whether the worker is wanted. The job's arena and `left` are still there. NULL: nothing. */
	void (*later)(struct work *work);
	bool (*is_wanted)(void *context); /* there is something to be claimed, or the process was asked to stop */
	void *wanted_context;             /* borrowed */
	void *left;                       /* the handler's own */
};

/* One of these in each job_*.c; rows of the table in worker.c. Errors as the solver gives them. */
enum tw_status job_import_mesh(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_import_motion(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_compute_field(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_compute_layout(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_draw(struct work *work, struct tw_error *error) TW_NODISCARD;

/* --- what they share -------------------------------------------------------------------------------------------- */

/* Tells progress and, when the job is to stop, fails with TW_ERROR_CANCELLED. */
enum tw_status work_step(struct work *work, double share, const char *stage, struct tw_error *error) TW_NODISCARD;
bool work_is_stopped(const struct work *work);

/* The text of `json` (a new reference, which is taken over; NULL: out of memory) becomes the result's summary. */
enum tw_status work_summary(struct work *work, json_t *json, struct tw_error *error) TW_NODISCARD;

/* The one mesh that a resource is made from. */
enum tw_status work_find_mesh(struct work *work, const char *resource_id, char mesh_id[STORE_ID_SIZE],
			      struct tw_error *error) TW_NODISCARD;

#endif
