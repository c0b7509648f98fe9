/* The files of a stored mesh, as they came: what it was imported from, and can be again. */
#ifndef SERVICE_WORKER_MESH_UPLOAD_H
#define SERVICE_WORKER_MESH_UPLOAD_H

#include "solver/garment/import.h"
#include "storage/store.h"

struct mesh_upload {
	struct garment_source worn, pattern;
	bool has_pattern; /* a file of its own */
};

/* Both in the arena, whole. TW_ERROR_LIMIT "mesh-too-large" where the arena's limit does not hold them. */
enum tw_status mesh_upload_read(struct mesh_upload *upload, struct arena *arena, struct store *store,
				const char *mesh_id, struct tw_error *error) TW_NODISCARD;

/* garment_from_arrays for a mesh of which an older release kept less than this one needs: what is missing is made again
 * from the uploads, where the import still gives what was kept. Where it does not, garment_from_arrays's
 * "garment-outdated" remains. */
enum tw_status mesh_upload_complete(struct garment *garment, struct arena *arena, struct store *store,
				    const char *mesh_id, const struct import_options *options,
				    const struct tw_array *kept, size_t kept_count,
				    struct tw_error *error) TW_NODISCARD;

#endif
