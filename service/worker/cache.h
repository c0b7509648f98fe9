/* The last garment and the last field that a worker used, because a designer who drags a terminal asks for the same
 * ones again and again. Meshes and fields are addressed by content, so what is here is never out of date. */
#ifndef SERVICE_WORKER_CACHE_H
#define SERVICE_WORKER_CACHE_H

#include "solver/field/field.h"
#include "solver/garment/garment.h"
#include "solver/garment/options.h"
#include "storage/store.h"

struct cache;
struct layout_base;

struct cached_mesh {
	char id[STORE_ID_SIZE];
	uint32_t version; /* of the computation that made it */
	struct import_options options;
	struct garment garment;
	struct topology topology;
};

struct cached_field {
	char id[STORE_ID_SIZE];
	uint32_t version; /* of the computation that made it */
	struct field field;
};

/* `budget`: bytes that it may hold, 0 for no limit. What alone is larger than that cannot be loaded. NULL when out of
 * memory. */
struct cache *cache_new(size_t budget);
void cache_free(struct cache *cache);

/* Loads what is not here already. The result is borrowed until the next call for another id. Errors of the store;
 * TW_ERROR_INTERNAL for arrays that do not fit together. */
enum tw_status cache_mesh(struct cache *cache, struct store *store, const char *id, const struct cached_mesh **mesh,
			  struct tw_error *error) TW_NODISCARD;
enum tw_status cache_field(struct cache *cache, struct store *store, const char *id, const struct cached_mesh *mesh,
			   const struct cached_field **field, struct tw_error *error) TW_NODISCARD;

/* What all layouts of the field that was asked for last share; NULL where it does not fit: then each makes its own. */
enum tw_status cache_base(struct cache *cache, const struct cached_mesh *mesh, const struct cached_field *field,
			  const struct layout_base **base, struct tw_error *error) TW_NODISCARD;

/* All arrays of a resource into an arena, with their names. */
enum tw_status cache_read_arrays(struct arena *arena, struct store *store, const char *id, struct tw_array **arrays,
				 size_t *count, struct tw_error *error) TW_NODISCARD;

/* One array of f64 with one column into an arena. TW_ERROR_INTERNAL when it has another shape. */
enum tw_status cache_read_doubles(struct arena *arena, struct store *store, const char *id, const char *name,
				  uint64_t rows, double **values, struct tw_error *error) TW_NODISCARD;

/* Options as they are kept with a resource (JSON) into the struct of their table. */
enum tw_status cache_read_options(const struct option_table *table, void *values, const char *json,
				  struct tw_error *error) TW_NODISCARD;

#endif
