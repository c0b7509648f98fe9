#include "service/worker/mesh_upload.h"

#include "storage/blob.h"

#include <string.h>

/* A whole upload in the arena. TW_ERROR_NOT_FOUND where there is no such part. */
static enum tw_status read_part(struct garment_source *source, struct arena *arena, struct store *store,
				const char *mesh_id, const char *part, struct tw_error *error)
{
	struct blob blob;
	size_t got = 0;
	enum tw_status status = blob_find(store, mesh_id, BLOB_UPLOAD, part, &blob, error);
	if (status != TW_OK)
		return status;
	char *name = ARENA_ARRAY(arena, sizeof blob.file_name, char);
	char *bytes = ARENA_ARRAY(arena, (size_t)blob.size, char);
	if (!name || !bytes)
		return tw_fail(error, TW_ERROR_LIMIT, "mesh-too-large", NULL,
			       "the file of %llu bytes does not fit into the worker's memory limit",
			       (unsigned long long)blob.size);
	memcpy(name, blob.file_name, sizeof blob.file_name);
	status = blob_read(store, blob.number, 0, bytes, (size_t)blob.size, &got, error);
	*source = (struct garment_source){bytes, got, MESH_SNIFF, name[0] ? name : NULL};
	return status;
}

enum tw_status mesh_upload_read(struct mesh_upload *upload, struct arena *arena, struct store *store,
				const char *mesh_id, struct tw_error *error)
{
	enum tw_status status = read_part(&upload->worn, arena, store, mesh_id, "worn", error);
	if (status != TW_OK)
		return status;
	status = read_part(&upload->pattern, arena, store, mesh_id, "pattern", error);
	upload->has_pattern = status == TW_OK;
	return status == TW_ERROR_NOT_FOUND ? TW_OK : status;
}

/* An older release may have kept less of a mesh than this one needs. Its uploads are kept, so that what is missing can
 * be made again, as long as the import still gives the same mesh. */

static const struct tw_array *find_array(const struct tw_array *arrays, size_t count, const char *name)
{
	for (size_t i = 0; i < count; i++)
		if (!strcmp(arrays[i].name, name))
			return &arrays[i];
	return NULL;
}

static size_t array_bytes(const struct tw_array *array)
{
	return (size_t)array->rows * array->columns * tw_type_size(array->type);
}

static bool same_array(const struct tw_array *a, const struct tw_array *b)
{
	return a->type == b->type && a->columns == b->columns && a->rows == b->rows &&
	       (a->rows == 0 || !memcmp(a->data, b->data, array_bytes(a)));
}

/* Puts behind the `*count` kept arrays those of `made` that are not among them; false where one that is differs. There
 * is room for all. */
static bool merge_arrays(struct arena *arena, struct tw_array *kept, size_t *count, const struct tw_array *made,
			 size_t made_count)
{
	const size_t kept_count = *count;
	for (size_t i = 0; i < made_count; i++) {
		const struct tw_array *same = find_array(kept, kept_count, made[i].name);
		if (same && !same_array(same, &made[i]))
			return false;
		if (same)
			continue;
		char *bytes = ARENA_ARRAY(arena, array_bytes(&made[i]) + 1, char);
		if (!bytes)
			return false;
		memcpy(bytes, made[i].data, array_bytes(&made[i]));
		kept[*count] = made[i];
		kept[(*count)++].data = bytes;
	}
	return true;
}

static enum tw_status import_again(struct arena *arena, struct store *store, const char *id,
				   const struct import_options *options, struct tw_array made[GARMENT_ARRAYS],
				   size_t *made_count, struct tw_error *error)
{
	struct mesh_upload upload;
	struct garment garment;
	struct garment_report report;
	struct topology topology;
	enum tw_status status = mesh_upload_read(&upload, arena, store, id, error);
	if (status == TW_OK)
		status = garment_import(&garment, arena, &upload.worn, upload.has_pattern ? &upload.pattern : NULL,
					options, &report, error);
	if (status == TW_OK)
		status = topology_build(&topology, arena, &garment, error);
	return status == TW_OK ? garment_to_arrays(&garment, &topology, arena, made, made_count, error) : status;
}

enum tw_status mesh_upload_complete(struct garment *garment, struct arena *arena, struct store *store,
				    const char *mesh_id, const struct import_options *options,
				    const struct tw_array *kept, size_t kept_count, struct tw_error *error)
{
	struct tw_array made[GARMENT_ARRAYS];
	size_t count = kept_count, made_count = 0;
	struct arena *scratch = arena_new(0);
	struct tw_array *all = ARENA_ARRAY(arena, kept_count + GARMENT_ARRAYS, struct tw_array);
	bool complete =
		scratch && all && import_again(scratch, store, mesh_id, options, made, &made_count, NULL) == TW_OK;
	if (complete) {
		memcpy(all, kept, kept_count * sizeof *all);
		complete = merge_arrays(arena, all, &count, made, made_count);
	}
	arena_free(scratch);
	return garment_from_arrays(garment, arena, complete ? all : kept, complete ? count : kept_count, error);
}
