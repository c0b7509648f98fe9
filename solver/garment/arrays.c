/* A garment as named arrays and back. Order and types of the arrays are the stored format: they do not change. */
#include "solver/garment/garment.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

static enum tw_status pack_names(const struct garment *garment, struct arena *arena, struct tw_array *array,
				 struct tw_error *error)
{
	size_t size = 0;
	for (uint32_t i = 0; i < garment->piece_count; i++)
		size += strlen(garment->piece_name[i]) + 1;
	char *packed = ARENA_ARRAY(arena, size, char);
	if (!packed)
		return tw_fail_memory(error);
	*array = (struct tw_array){.name = "piece_name", .type = TW_U8, .columns = 1, .rows = size, .data = packed};
	for (uint32_t i = 0; i < garment->piece_count; i++)
		packed = stpcpy(packed, garment->piece_name[i]) + 1;
	return TW_OK;
}

enum tw_status garment_to_arrays(const struct garment *garment, struct arena *arena,
				 struct tw_array arrays[GARMENT_ARRAYS], size_t *count, struct tw_error *error)
{
	const struct garment *g = garment;
	arrays[0] = (struct tw_array){"position", TW_F64, 3, g->vertex_count, g->position};
	arrays[1] = (struct tw_array){"pattern", TW_F64, 2, g->coord_count, g->pattern};
	arrays[2] = (struct tw_array){"face_vertex", TW_U32, 3, g->face_count, g->face_vertex};
	arrays[3] = (struct tw_array){"face_coord", TW_U32, 3, g->face_count, g->face_coord};
	arrays[4] = (struct tw_array){"face_piece", TW_U32, 1, g->face_count, g->face_piece};
	enum tw_status status = pack_names(garment, arena, &arrays[5], error);
	if (status != TW_OK)
		return status;
	*count = 6;
	if (!g->source_vertex)
		return TW_OK;
	uint32_t *source_count = ARENA_ARRAY(arena, 1, uint32_t);
	if (!source_count)
		return tw_fail_memory(error);
	*source_count = g->source_count;
	arrays[6] = (struct tw_array){"source_vertex", TW_U32, 3, g->vertex_count, g->source_vertex};
	arrays[7] = (struct tw_array){"source_share", TW_F64, 3, g->vertex_count, g->source_share};
	arrays[8] = (struct tw_array){"source_count", TW_U32, 1, 1, source_count};
	*count = GARMENT_ARRAYS;
	return TW_OK;
}

static enum tw_status damaged(const char *name, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "garment-damaged", name,
		       "the stored array %s of this garment is missing or damaged; import the garment again", name);
}

/* NULL when there is no such array, or not of this form. */
static const struct tw_array *find(const struct tw_array *arrays, size_t count, const char *name, enum tw_type type,
				   uint32_t columns)
{
	for (size_t i = 0; i < count; i++) {
		if (strcmp(arrays[i].name, name) == 0)
			return arrays[i].type == type && arrays[i].columns == columns ? &arrays[i] : NULL;
	}
	return NULL;
}

static bool indexes_below(const uint32_t *values, size_t count, uint32_t limit)
{
	for (size_t i = 0; i < count; i++) {
		if (values[i] >= limit)
			return false;
	}
	return true;
}

static bool all_finite(const double *values, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		if (!isfinite(values[i]))
			return false;
	}
	return true;
}

/* Points piece_name at the names, which lie one behind the other. */
static enum tw_status unpack_names(struct garment *garment, struct arena *arena, const struct tw_array *array,
				   struct tw_error *error)
{
	const char *bytes = array->data;
	if (array->rows == 0 || bytes[array->rows - 1] != '\0')
		return damaged("piece_name", error);
	for (uint64_t i = 0; i < array->rows; i++)
		garment->piece_count += bytes[i] == '\0';
	char *copy = ARENA_ARRAY(arena, array->rows, char);
	garment->piece_name = ARENA_ARRAY(arena, garment->piece_count, char *);
	if (!copy || !garment->piece_name)
		return tw_fail_memory(error);
	memcpy(copy, bytes, array->rows);
	for (uint32_t i = 0; i < garment->piece_count; i++) {
		garment->piece_name[i] = copy;
		copy += strlen(copy) + 1;
	}
	return TW_OK;
}

static enum tw_status read_source(struct garment *garment, const struct tw_array *arrays, size_t count,
				  struct tw_error *error)
{
	const struct tw_array *source = find(arrays, count, "source_vertex", TW_U32, 3);
	const struct tw_array *share = find(arrays, count, "source_share", TW_F64, 3);
	const struct tw_array *total = find(arrays, count, "source_count", TW_U32, 1);
	if (!source && !share && !total) {
		garment->source_count = garment->vertex_count;
		return TW_OK;
	}
	if (!total || total->rows != 1)
		return damaged("source_count", error);
	garment->source_count = *(const uint32_t *)total->data;
	if (!source || source->rows != garment->vertex_count ||
	    !indexes_below(source->data, 3 * source->rows, garment->source_count))
		return damaged("source_vertex", error);
	if (!share || share->rows != garment->vertex_count || !all_finite(share->data, 3 * share->rows))
		return damaged("source_share", error);
	garment->source_vertex = (uint32_t *)source->data;
	garment->source_share = (double *)share->data;
	return TW_OK;
}

enum tw_status garment_from_arrays(struct garment *garment, struct arena *arena, const struct tw_array *arrays,
				   size_t count, struct tw_error *error)
{
	*garment = (struct garment){0};
	const struct tw_array *position = find(arrays, count, "position", TW_F64, 3);
	const struct tw_array *pattern = find(arrays, count, "pattern", TW_F64, 2);
	const struct tw_array *face_vertex = find(arrays, count, "face_vertex", TW_U32, 3);
	const struct tw_array *face_coord = find(arrays, count, "face_coord", TW_U32, 3);
	const struct tw_array *face_piece = find(arrays, count, "face_piece", TW_U32, 1);
	const struct tw_array *piece_name = find(arrays, count, "piece_name", TW_U8, 1);
	if (!piece_name)
		return damaged("piece_name", error);
	enum tw_status status = unpack_names(garment, arena, piece_name, error);
	if (status != TW_OK)
		return status;
	if (!position || position->rows > UINT32_MAX || !all_finite(position->data, 3 * position->rows))
		return damaged("position", error);
	if (!pattern || pattern->rows > UINT32_MAX || !all_finite(pattern->data, 2 * pattern->rows))
		return damaged("pattern", error);
	if (!face_vertex || face_vertex->rows > UINT32_MAX / 3 ||
	    !indexes_below(face_vertex->data, 3 * face_vertex->rows, (uint32_t)position->rows))
		return damaged("face_vertex", error);
	if (!face_coord || face_coord->rows != face_vertex->rows ||
	    !indexes_below(face_coord->data, 3 * face_coord->rows, (uint32_t)pattern->rows))
		return damaged("face_coord", error);
	if (!face_piece || face_piece->rows != face_vertex->rows ||
	    !indexes_below(face_piece->data, face_piece->rows, garment->piece_count))
		return damaged("face_piece", error);

	garment->vertex_count = (uint32_t)position->rows;
	garment->coord_count = (uint32_t)pattern->rows;
	garment->face_count = (uint32_t)face_vertex->rows;
	garment->position = (double *)position->data;
	garment->pattern = (double *)pattern->data;
	garment->face_vertex = (uint32_t *)face_vertex->data;
	garment->face_coord = (uint32_t *)face_coord->data;
	garment->face_piece = (uint32_t *)face_piece->data;
	return read_source(garment, arrays, count, error);
}
