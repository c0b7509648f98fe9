/* The frames of a stored motion, in whatever form they were kept. */
#ifndef SERVICE_WORKER_MOTION_SOURCE_H
#define SERVICE_WORKER_MOTION_SOURCE_H

#include "service/worker/blob_source.h"
#include "service/worker/cache.h"

/* Whether anything was kept of them. */
enum tw_status motion_has_frames(struct store *store, const char *motion_id, bool *has,
				 struct tw_error *error) TW_NODISCARD;

/* Opens them at the first. `source` is what the reader reads from: it must outlive the reader and is the caller's to
 * clear, also after an error. TW_ERROR_INPUT "motion-without-frames" where nothing was kept; errors of motion_open. */
enum tw_status motion_source_open(struct motion_reader **reader, struct blob_source *source, struct store *store,
				  const struct cached_mesh *mesh, const char *motion_id,
				  struct tw_error *error) TW_NODISCARD;

#endif
