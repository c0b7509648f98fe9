/* What layouts, and drawings of them, are computed from: mesh, field and motions out of the store. */
#ifndef SERVICE_WORKER_LAYOUT_WORK_H
#define SERVICE_WORKER_LAYOUT_WORK_H

#include "service/worker/blob_source.h"
#include "service/worker/work.h"
#include "solver/layout/layout.h"

/* The motions are the field's. */
struct layout_work {
	struct work *work;
	const struct cached_mesh *mesh; /* both borrowed from the cache */
	const struct cached_field *field;
	const struct layout_base *base;    /* NULL where it does not fit the cache */
	char (*motion_ids)[STORE_ID_SIZE]; /* owned */
	const char **motion_names;         /* owned list of owned names */
	bool *motion_has_frames;           /* owned */
	size_t motion_count;
	struct blob_source source; /* of the motion that is open; cleared when the next is opened */
};

/* Loads mesh and field of a layout; layout_work_clear, also after an error. */
enum tw_status layout_work_load(struct layout_work *layout, struct work *work, const char *layout_id,
				struct tw_error *error) TW_NODISCARD;

/* And what is told of its motions. */
enum tw_status layout_work_load_motions(struct layout_work *layout, struct tw_error *error) TW_NODISCARD;

void layout_work_clear(struct layout_work *layout);

/* What every computation on it is given; request, files and motions are still to be said. Its context is `layout`. */
struct layout_input layout_work_input(struct layout_work *layout);

/* The files of an output become the job's artifacts. TW_ERROR_MEMORY. */
enum tw_status layout_work_take_files(struct work *work, const struct layout_output *output,
				      struct tw_error *error) TW_NODISCARD;

#endif
