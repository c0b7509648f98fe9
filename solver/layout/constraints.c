#include "solver/layout/constraints.h"

#include "solver/layout/json.h"
#include "solver/names.h"
#include "solver/option.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { POINTER_SIZE = 112, REGIONS_MAX = 4096, POINTS_MAX = 4096 };
#define FACTOR_MAX 1000.0
#define PRICE_MAX 1e9

static enum tw_status fail_type(const char *where, const char *what, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "json-type", where, "must be %s", what);
}

/* The array's length, where it is an array of 1 to `limit` items. */
static enum tw_status read_array(uint32_t *count, const json_t *array, uint32_t limit, const char *where,
				 struct tw_error *error)
{
	size_t size = json_array_size(array);
	if (!json_is_array(array) || size == 0)
		return fail_type(where, "an array that is not empty", error);
	if (size > limit)
		return tw_fail(error, TW_ERROR_LIMIT, "json-too-large", where, "has %zu items, more than %u", size,
			       limit);
	*count = (uint32_t)size;
	return TW_OK;
}

static enum tw_status read_faces(struct face_region *region, const json_t *array, const char *where,
				 struct tw_error *error)
{
	enum tw_status status = read_array(&region->face_count, array, TW_LIMIT_FACES, where, error);
	if (status != TW_OK)
		return status;
	region->face = malloc(region->face_count * sizeof *region->face);
	if (!region->face)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < region->face_count && status == TW_OK; i++) {
		char place[POINTER_SIZE + 16];
		snprintf(place, sizeof place, "%s/%u", where, i);
		status = json_read_index(&region->face[i], json_array_get(array, i), place, error);
	}
	return status;
}

static enum tw_status read_polygon(struct face_region *region, const json_t *array, const char *where,
				   struct tw_error *error)
{
	enum tw_status status = read_array(&region->point_count, array, POINTS_MAX, where, error);
	if (status != TW_OK)
		return status;
	if (region->point_count < 3)
		return tw_fail(error, TW_ERROR_INPUT, "json-value", where, "a polygon needs three points or more");
	region->polygon = malloc(2 * (size_t)region->point_count * sizeof *region->polygon);
	if (!region->polygon)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < region->point_count && status == TW_OK; i++) {
		char place[POINTER_SIZE + 16];
		snprintf(place, sizeof place, "%s/%u", where, i);
		status = json_read_numbers(&region->polygon[2 * (size_t)i], 2, json_array_get(array, i), place, error);
	}
	return status;
}

static enum tw_status read_price(double *price, const json_t *value, double limit, const char *where,
				 struct tw_error *error)
{
	double number = json_number_value(value);
	if (!json_is_number(value) || !(number >= 0 && number <= limit))
		return tw_fail(error, TW_ERROR_INPUT, "json-value", where, "must be a number from 0 to %g", limit);
	*price = number;
	return TW_OK;
}

static enum tw_status read_member(struct face_region *region, const char *key, const json_t *value, bool has_factor,
				  const char *where, struct tw_error *error)
{
	if (!strcmp(key, "faces"))
		return read_faces(region, value, where, error);
	if (!strcmp(key, "piece"))
		return json_read_text(&region->piece, value, where, error);
	if (!strcmp(key, "polygon_mm"))
		return read_polygon(region, value, where, error);
	if (has_factor && !strcmp(key, "factor"))
		return read_price(&region->factor, value, FACTOR_MAX, where, error);
	static const char *const known[] = {"faces", "piece", "polygon_mm", "factor"};
	const struct names names = {known, has_factor ? 4 : 3};
	return names_refuse(&names, "member", key, "json-unknown-field", where, error);
}

static enum tw_status read_region(struct face_region *region, const json_t *object, bool has_factor, const char *where,
				  struct tw_error *error)
{
	if (!json_is_object(object))
		return fail_type(where, "an object", error);
	region->factor = NAN;
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)object, key, value)
	{
		char place[POINTER_SIZE];
		option_pointer(place, sizeof place, where, key);
		enum tw_status status = read_member(region, key, value, has_factor, place, error);
		if (status != TW_OK)
			return status;
	}
	bool polygon = region->piece && region->polygon;
	if ((region->face != NULL) == polygon || (region->face && (region->piece || region->polygon)))
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", where,
			       "say which fabric: \"faces\", or \"piece\" and \"polygon_mm\"");
	if (has_factor && isnan(region->factor))
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", where, "a multiplier needs a \"factor\"");
	return TW_OK;
}

/* *regions is filled as far as it goes, so that clearing frees all of it. */
static enum tw_status read_regions(struct face_region **regions, uint32_t *region_count, const json_t *array,
				   bool has_factor, const char *where, struct tw_error *error)
{
	uint32_t count;
	enum tw_status status = read_array(&count, array, REGIONS_MAX, where, error);
	if (status != TW_OK)
		return status;
	*regions = calloc(count, sizeof **regions);
	if (!*regions)
		return tw_fail_memory(error);
	*region_count = count;
	for (uint32_t i = 0; i < count && status == TW_OK; i++) {
		char place[POINTER_SIZE];
		snprintf(place, sizeof place, "%.90s/%u", where, i);
		status = read_region(&(*regions)[i], json_array_get(array, i), has_factor, place, error);
	}
	return status;
}

static enum tw_status read_free_edges(struct layout_constraints *constraints, const json_t *array, const char *where,
				      struct tw_error *error)
{
	enum tw_status status = read_array(&constraints->free_edge_count, array, TW_LIMIT_FACES, where, error);
	if (status != TW_OK)
		return status;
	constraints->free_edge = calloc(constraints->free_edge_count, 2 * sizeof *constraints->free_edge);
	if (!constraints->free_edge)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < constraints->free_edge_count && status == TW_OK; i++) {
		const json_t *pair = json_array_get(array, i);
		char place[POINTER_SIZE];
		snprintf(place, sizeof place, "%.90s/%u", where, i);
		if (!json_is_array(pair) || json_array_size(pair) != 2)
			return fail_type(place, "a pair of vertices", error);
		for (uint32_t k = 0; k < 2 && status == TW_OK; k++)
			status = json_read_index(&constraints->free_edge[2 * (size_t)i + k], json_array_get(pair, k),
						 place, error);
	}
	return status;
}

static enum tw_status read_constraint(struct layout_constraints *constraints, const char *key, const json_t *value,
				      const char *where, struct tw_error *error)
{
	if (!strcmp(key, "keep_out"))
		return read_regions(&constraints->keep_out, &constraints->keep_out_count, value, false, where, error);
	if (!strcmp(key, "face_multipliers"))
		return read_regions(&constraints->multiplier, &constraints->multiplier_count, value, true, where,
				    error);
	if (!strcmp(key, "seam_price_mpa_mm2"))
		return read_price(&constraints->seam_price_mpa_mm2, value, PRICE_MAX, where, error);
	if (!strcmp(key, "free_edges"))
		return read_free_edges(constraints, value, where, error);
	static const char *const known[] = {"keep_out", "face_multipliers", "seam_price_mpa_mm2", "free_edges"};
	const struct names names = {known, sizeof known / sizeof *known};
	return names_refuse(&names, "constraint", key, "json-unknown-field", where, error);
}

enum tw_status layout_constraints_parse(struct layout_constraints *constraints, const json_t *object, const char *where,
					struct tw_error *error)
{
	if (!json_is_object(object))
		return fail_type(where, "an object", error);
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)object, key, value)
	{
		char place[POINTER_SIZE];
		option_pointer(place, sizeof place, where, key);
		enum tw_status status = read_constraint(constraints, key, value, place, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

static void clear_regions(struct face_region *regions, uint32_t count)
{
	for (uint32_t i = 0; i < count; i++) {
		free(regions[i].face);
		free(regions[i].piece);
		free(regions[i].polygon);
	}
	free(regions);
}

void layout_constraints_clear(struct layout_constraints *constraints)
{
	clear_regions(constraints->keep_out, constraints->keep_out_count);
	clear_regions(constraints->multiplier, constraints->multiplier_count);
	free(constraints->free_edge);
	*constraints = (struct layout_constraints){0};
}
