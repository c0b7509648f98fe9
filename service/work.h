/* What a job has to work with. A handler (job_*.c) reads the resource and what that is made from, calls the solver, and
 * leaves the result here; the worker stores it. Handlers write nothing themselves. */
#ifndef SERVICE_WORK_H
#define SERVICE_WORK_H

#include "service/cache.h"
#include "service/pulse.h"
#include "solver/arena.h"
#include "solver/motion/motion.h"
#include "storage/blob.h"
#include "storage/resource.h"

#include <jansson.h>

struct work {
	struct store *store;             /* borrowed; the worker's connection */
	const struct resource *resource; /* borrowed; what is to be made */
	struct cache *cache;             /* borrowed; the last garment and field */
	struct pulse *pulse;             /* borrowed */
	struct arena *arena;             /* borrowed; the result lies here */
	bool (*stop)(void);              /* the process was asked to stop at once */
	unsigned threads;
	size_t memory_limit; /* bytes of scratch for a search */
	struct job_result result;
};

/* One of these in each job_*.c; rows of the table in worker.c. Errors as the solver gives them. */
enum tw_status job_import_mesh(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_import_motion(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_compute_field(struct work *work, struct tw_error *error) TW_NODISCARD;
enum tw_status job_compute_layout(struct work *work, struct tw_error *error) TW_NODISCARD;

/* --- what they share
 * -------------------------------------------------------------------------------------------------- */

/* Tells progress and, when the job is to stop, fails with TW_ERROR_CANCELLED. */
enum tw_status work_step(struct work *work, double share, const char *stage, struct tw_error *error) TW_NODISCARD;
bool work_is_stopped(const struct work *work);

/* The text of `json` (a new reference, which is taken over; NULL: out of memory) becomes the result's summary. */
enum tw_status work_summary(struct work *work, json_t *json, struct tw_error *error) TW_NODISCARD;

/* The one mesh that a resource is made from. */
enum tw_status work_find_mesh(struct work *work, const char *resource_id, char mesh_id[STORE_ID_SIZE],
			      struct tw_error *error) TW_NODISCARD;

/* A stored blob as a stream, read a chunk at a time. Free with blob_source_clear. */
struct blob_source {
	struct store *store; /* borrowed */
	struct blob blob;
	uint64_t at;     /* where in the blob the buffer ends */
	size_t buffered; /* bytes in the buffer */
	size_t used;     /* of them, handed out */
	char *buffer;    /* owned, BLOB_CHUNK bytes */
};
enum tw_status blob_source_init(struct blob_source *source, struct store *store, const char *resource_id,
				const char *part, struct byte_source *stream, struct tw_error *error) TW_NODISCARD;
void blob_source_clear(struct blob_source *source);

/* What a motion's arrays of means are called, by enum strain_model: "mean_stvk" … */
extern const char *const work_mean_names[];

/* The means of all three energy models over a motion's frames, in the work's arena; `mean[STRAIN_MODELS]` each
 * [face_count]. Progress goes from `share_from` to `share_to`. `info` may be NULL. */
struct cached_mesh;
struct field_options;
enum tw_status work_motion_means(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
				 const struct field_options *options, double share_from, double share_to, double **mean,
				 struct motion_info *info, struct tw_error *error) TW_NODISCARD;

#endif
