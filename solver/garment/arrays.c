/* A garment as named arrays and back. Order and types of the arrays are the stored format: they do not change. */
#include "solver/garment/correspondence.h"

#include <assert.h>
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

/* Numbers that the garment does not hold because they are its own, or follow from others. */
static uint32_t *list_file_vertices(const struct garment *garment, struct arena *arena)
{
	uint32_t *list = ARENA_ARRAY(arena, garment->vertex_count, uint32_t);
	for (uint32_t v = 0; list && v < garment->vertex_count; v++)
		list[v] = garment_file_vertex(garment, v);
	return list;
}

static uint32_t *list_mesh_vertices(const struct garment *garment, struct arena *arena)
{
	uint32_t *list = ARENA_ARRAY(arena, garment_source_count(garment), uint32_t);
	for (uint32_t v = 0; list && v < garment_source_count(garment); v++)
		list[v] = garment_mesh_vertex(garment, v);
	return list;
}

static uint32_t *list_file_faces(const struct garment *garment, struct arena *arena)
{
	uint32_t *list = ARENA_ARRAY(arena, garment->face_count, uint32_t);
	for (uint32_t f = 0; list && f < garment->face_count; f++)
		list[f] = garment_file_face(garment, f);
	return list;
}

enum tw_status garment_to_arrays(const struct garment *garment, const struct topology *topology, struct arena *arena,
				 struct tw_array arrays[GARMENT_ARRAYS], size_t *count, struct tw_error *error)
{
	const struct garment *g = garment;
	uint32_t *file_vertex = list_file_vertices(g, arena), *mesh_vertex = list_mesh_vertices(g, arena);
	uint32_t *file_face = list_file_faces(g, arena), *source_count = ARENA_ARRAY(arena, 1, uint32_t);
	if (!file_vertex || !mesh_vertex || !file_face || !source_count)
		return tw_fail_memory(error);
	struct tw_array *next = arrays;
	*next++ = (struct tw_array){"position", TW_F64, 3, g->vertex_count, g->position};
	*next++ = (struct tw_array){"pattern", TW_F64, 2, g->coord_count, g->pattern};
	*next++ = (struct tw_array){"face_vertex", TW_U32, 3, g->face_count, g->face_vertex};
	*next++ = (struct tw_array){"face_coord", TW_U32, 3, g->face_count, g->face_coord};
	*next++ = (struct tw_array){"face_piece", TW_U32, 1, g->face_count, g->face_piece};
	enum tw_status status = pack_names(garment, arena, next++, error);
	*next++ = (struct tw_array){"edge_vertex", TW_U32, 2, topology->edge_count, topology->edge_vertex};
	*next++ = (struct tw_array){"file_vertex", TW_U32, 1, g->vertex_count, file_vertex};
	*next++ = (struct tw_array){"mesh_vertex", TW_U32, 1, garment_source_count(g), mesh_vertex};
	*next++ = (struct tw_array){"file_face", TW_U32, 1, g->face_count, file_face};
	if (g->file_face)
		*next++ = (struct tw_array){"file_corner", TW_U32, 3, g->file_face_count, g->file_corner};
	if (g->source_vertex) {
		*source_count = g->source_count;
		*next++ = (struct tw_array){"source_vertex", TW_U32, 3, g->vertex_count, g->source_vertex};
		*next++ = (struct tw_array){"source_share", TW_F64, 3, g->vertex_count, g->source_share};
		*next++ = (struct tw_array){"source_count", TW_U32, 1, 1, source_count};
	}
	*count = (size_t)(next - arrays);
	assert(*count <= GARMENT_ARRAYS);
	return status;
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

static bool ascends_below(const uint32_t *values, uint64_t count, uint32_t limit)
{
	for (uint64_t i = 0; i < count; i++) {
		if (values[i] >= limit || (i > 0 && values[i] < values[i - 1]))
			return false;
	}
	return true;
}

/* Each face of the file has parts and three corners, or GARMENT_NONE three times. */
static bool corners_fit(const struct garment *garment, const struct tw_array *corner, const uint32_t *file_face)
{
	const uint32_t *values = corner->data;
	if (corner->rows == 0 || corner->rows > garment->face_count)
		return false;
	for (uint64_t f = 0; f < corner->rows; f++) {
		bool none = values[3 * f] == GARMENT_NONE && values[3 * f + 1] == GARMENT_NONE &&
			    values[3 * f + 2] == GARMENT_NONE;
		if (!none && !indexes_below(values + 3 * f, 3, garment->vertex_count))
			return false;
	}
	uint64_t met = 0;
	for (uint32_t f = 0; f < garment->face_count; f++)
		met += f == 0 || file_face[f] != file_face[f - 1];
	return met == corner->rows;
}

/* The vertices and faces of the file. */
static enum tw_status read_file_numbers(struct garment *garment, const struct tw_array *arrays, size_t count,
					struct tw_error *error)
{
	const struct tw_array *mesh_vertex = find(arrays, count, "mesh_vertex", TW_U32, 1);
	const struct tw_array *file_face = find(arrays, count, "file_face", TW_U32, 1);
	const struct tw_array *corner = find(arrays, count, "file_corner", TW_U32, 3);
	if (!mesh_vertex && !file_face && !corner)
		return !garment->source_vertex ? TW_OK
					       : tw_fail(error, TW_ERROR_INPUT, "garment-outdated", NULL,
							 "this mesh was imported by an earlier version of tightwire, "
							 "which did not keep "
							 "the numbers of its file; upload the file again");
	if (!mesh_vertex || mesh_vertex->rows != garment->source_count ||
	    !indexes_below(mesh_vertex->data, mesh_vertex->rows, garment->vertex_count))
		return damaged("mesh_vertex", error);
	if (!file_face || file_face->rows != garment->face_count)
		return damaged("file_face", error);
	garment->mesh_vertex = (uint32_t *)mesh_vertex->data;
	if (!corner)
		return TW_OK; /* faces are the file's */
	if (corner->rows > UINT32_MAX || !ascends_below(file_face->data, file_face->rows, (uint32_t)corner->rows))
		return damaged("file_face", error);
	if (!corners_fit(garment, corner, file_face->data))
		return damaged("file_corner", error);
	garment->file_face = (uint32_t *)file_face->data;
	garment->file_face_count = (uint32_t)corner->rows;
	garment->file_corner = (uint32_t *)corner->data;
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
	status = read_source(garment, arrays, count, error);
	return status == TW_OK ? read_file_numbers(garment, arrays, count, error) : status;
}
