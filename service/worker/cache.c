/* Garments and fields from the store into memory, the last of each kept. */
#include "service/worker/cache.h"

#include "service/worker/mesh_upload.h"
#include "solver/layout/base.h"
#include "storage/blob.h"
#include "storage/resources.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "arrays are stored as they lie in memory");

struct cache {
	size_t budget; /* of both arenas together; 0: no limit */
	struct arena *mesh_arena;
	struct cached_mesh mesh; /* id "" when there is none */
	struct arena *field_arena;
	struct cached_field field;
	bool has_tried_base;
	struct layout_base *base; /* in field_arena; NULL: none was made, or it does not fit */
};

struct cache *cache_new(size_t budget)
{
	struct cache *cache = calloc(1, sizeof *cache);
	if (cache)
		cache->budget = budget;
	return cache;
}

/* What a field may take beside its mesh, which is the same whenever that mesh is loaded. */
static size_t field_budget(const struct cache *cache)
{
	size_t used = arena_used(cache->mesh_arena);
	if (!cache->budget)
		return 0;
	return used < cache->budget ? cache->budget - used : 1;
}

static void drop_field(struct cache *cache)
{
	arena_free(cache->field_arena);
	cache->field_arena = NULL;
	memset(&cache->field, 0, sizeof cache->field);
	cache->has_tried_base = false;
	cache->base = NULL;
}

static void drop_mesh(struct cache *cache)
{
	drop_field(cache);
	arena_free(cache->mesh_arena);
	cache->mesh_arena = NULL;
	memset(&cache->mesh, 0, sizeof cache->mesh);
}

void cache_free(struct cache *cache)
{
	if (cache)
		drop_mesh(cache);
	free(cache);
}

static enum tw_status read_whole(struct arena *arena, struct store *store, const struct blob *blob, void **bytes,
				 struct tw_error *error)
{
	size_t got = 0;
	*bytes = arena_array(arena, blob->size ? (size_t)blob->size : 1, 1);
	if (!*bytes)
		return tw_fail_memory(error);
	enum tw_status status = blob_read(store, blob->number, 0, *bytes, (size_t)blob->size, &got, error);
	if (status == TW_OK && got != blob->size)
		status = tw_fail(error, TW_ERROR_INTERNAL, "store-damaged", NULL, "the array %s is cut short",
				 blob->name);
	return status;
}

static enum tw_status read_array(struct arena *arena, struct store *store, const struct blob *blob,
				 struct tw_array *array, struct tw_error *error)
{
	void *bytes = NULL;
	char *name = ARENA_ARRAY(arena, sizeof blob->name, char);
	if (!name)
		return tw_fail_memory(error);
	memcpy(name, blob->name, sizeof blob->name);
	enum tw_status status = read_whole(arena, store, blob, &bytes, error);
	*array = (struct tw_array){name, blob->type, blob->columns, blob->rows, bytes};
	return status;
}

enum tw_status cache_read_arrays(struct arena *arena, struct store *store, const char *id, struct tw_array **arrays,
				 size_t *count, struct tw_error *error)
{
	struct blob *blobs = NULL;
	enum tw_status status = blob_list(store, id, BLOB_ARRAY, &blobs, count, error);
	if (status != TW_OK)
		return status;
	*arrays = ARENA_ARRAY(arena, *count, struct tw_array);
	if (!*arrays)
		status = tw_fail_memory(error);
	for (size_t i = 0; status == TW_OK && i < *count; i++)
		status = read_array(arena, store, &blobs[i], &(*arrays)[i], error);
	free(blobs);
	return status;
}

enum tw_status cache_read_doubles(struct arena *arena, struct store *store, const char *id, const char *name,
				  uint64_t rows, double **values, struct tw_error *error)
{
	struct blob blob;
	void *bytes = NULL;
	enum tw_status status = blob_find(store, id, BLOB_ARRAY, name, &blob, error);
	if (status == TW_OK && (blob.type != TW_F64 || blob.columns != 1 || blob.rows != rows))
		status = tw_fail(error, TW_ERROR_INTERNAL, "store-damaged", NULL,
				 "the array %s of %s has another shape", name, id);
	if (status == TW_OK)
		status = read_whole(arena, store, &blob, &bytes, error);
	*values = bytes;
	return status;
}

enum tw_status cache_read_options(const struct option_table *table, void *values, const char *json,
				  struct tw_error *error)
{
	option_defaults(table, values);
	json_error_t where;
	json_t *object = json_loads(json, 0, &where);
	if (!object)
		return tw_fail(error, TW_ERROR_INTERNAL, "store-damaged", NULL, "stored options are no JSON: %.100s",
			       where.text);
	enum tw_status status = option_from_json(table, values, object, "", NULL, error);
	json_decref(object);
	return status;
}

static enum tw_status read_resource_options(struct store *store, enum resource_kind kind, const char *id,
					    const struct option_table *table, void *values, uint32_t *version,
					    struct tw_error *error)
{
	struct resource resource;
	enum tw_status status = resource_get(store, TENANT_ANY, kind, id, &resource, error);
	if (status != TW_OK)
		return status;
	*version = resource.version;
	status = cache_read_options(table, values, resource.options, error);
	resource_clear(&resource);
	return status;
}

static enum tw_status load_mesh(struct cache *cache, struct store *store, const char *id, struct tw_error *error)
{
	struct cached_mesh *mesh = &cache->mesh;
	struct tw_array *arrays = NULL;
	size_t count = 0;
	cache->mesh_arena = arena_new(cache->budget);
	if (!cache->mesh_arena)
		return tw_fail_memory(error);
	enum tw_status status = read_resource_options(store, RESOURCE_MESH, id, &import_option_table, &mesh->options,
						      &mesh->version, error);
	if (status == TW_OK)
		status = cache_read_arrays(cache->mesh_arena, store, id, &arrays, &count, error);
	if (status == TW_OK)
		status = garment_from_arrays(&mesh->garment, cache->mesh_arena, arrays, count, error);
	if (status != TW_OK && error->type && !strcmp(error->type, "garment-outdated"))
		status = mesh_upload_complete(&mesh->garment, cache->mesh_arena, store, id, &mesh->options, arrays,
					      count, error);
	if (status == TW_OK)
		status = topology_build(&mesh->topology, cache->mesh_arena, &mesh->garment, error);
	snprintf(mesh->id, sizeof mesh->id, "%s", id);
	return status;
}

enum tw_status cache_mesh(struct cache *cache, struct store *store, const char *id, const struct cached_mesh **mesh,
			  struct tw_error *error)
{
	*mesh = &cache->mesh;
	if (!strcmp(cache->mesh.id, id))
		return TW_OK;
	drop_mesh(cache);
	enum tw_status status = load_mesh(cache, store, id, error);
	if (status != TW_OK)
		drop_mesh(cache);
	return status;
}

static enum tw_status load_field(struct cache *cache, struct store *store, const char *id,
				 const struct cached_mesh *mesh, struct tw_error *error)
{
	struct field_options options;
	struct tw_array *arrays = NULL;
	size_t count = 0;
	cache->field_arena = arena_new(field_budget(cache));
	if (!cache->field_arena)
		return tw_fail_memory(error);
	enum tw_status status = read_resource_options(store, RESOURCE_FIELD, id, &field_option_table, &options,
						      &cache->field.version, error);
	if (status == TW_OK)
		status = cache_read_arrays(cache->field_arena, store, id, &arrays, &count, error);
	if (status == TW_OK)
		status = field_from_arrays(&cache->field.field, &mesh->garment, &mesh->topology, arrays, count,
					   &options, error);
	snprintf(cache->field.id, sizeof cache->field.id, "%s", id);
	return status;
}

enum tw_status cache_field(struct cache *cache, struct store *store, const char *id, const struct cached_mesh *mesh,
			   const struct cached_field **field, struct tw_error *error)
{
	*field = &cache->field;
	if (!strcmp(cache->field.id, id))
		return TW_OK;
	drop_field(cache);
	enum tw_status status = load_field(cache, store, id, mesh, error);
	if (status != TW_OK)
		drop_field(cache);
	return status;
}

/* Whether it fits depends on mesh and field alone, as do the arenas. */
enum tw_status cache_base(struct cache *cache, const struct cached_mesh *mesh, const struct cached_field *field,
			  const struct layout_base **base, struct tw_error *error)
{
	assert(field == &cache->field && mesh == &cache->mesh);
	if (!cache->has_tried_base) {
		const struct arena_mark mark = arena_mark(cache->field_arena);
		struct layout_base *new = ARENA_ARRAY(cache->field_arena, 1, struct layout_base);
		enum tw_status status = new ? layout_base_build(new, cache->field_arena, &mesh->garment,
								&mesh->topology, &field->field, error)
					    : TW_ERROR_MEMORY;
		if (status != TW_OK && status != TW_ERROR_MEMORY)
			return status;
		if (status != TW_OK)
			arena_release(cache->field_arena, mark);
		*error = (struct tw_error){0};
		cache->base = status == TW_OK ? new : NULL;
		cache->has_tried_base = true;
	}
	*base = cache->base;
	return TW_OK;
}
