/* A field as named arrays and back, and what is said of one. */
#include "solver/field/field.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

size_t field_to_arrays(const struct field *field, struct tw_array arrays[FIELD_ARRAYS])
{
	arrays[0] = (struct tw_array){"density", TW_F64, 1, field->face_count, field->density};
	arrays[1] = (struct tw_array){"weight", TW_U64, 1, field->edge_count, field->weight};
	arrays[2] = (struct tw_array){"coverage", TW_F32, 1, field->edge_count, field->coverage};
	arrays[3] = (struct tw_array){"scale", TW_F64, 1, 1, &field->scale};
	if (!field->chord_weight)
		return 4;
	arrays[4] = (struct tw_array){"chord_weight", TW_U64, 1, field->edge_count, field->chord_weight};
	arrays[5] = (struct tw_array){"chord_coverage", TW_F32, 1, field->edge_count, field->chord_coverage};
	return 6;
}

static enum tw_status fail_array(const char *name, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INTERNAL, "field-damaged", name,
		       "the stored field does not fit its garment; compute it again");
}

static enum tw_status find_array(const void **data, const struct tw_array *arrays, size_t count, const char *name,
				 enum tw_type type, uint64_t rows, struct tw_error *error)
{
	for (size_t i = 0; i < count; i++) {
		if (strcmp(arrays[i].name, name) != 0)
			continue;
		if (arrays[i].type != type || arrays[i].columns != 1 || arrays[i].rows != rows || !arrays[i].data)
			break;
		*data = arrays[i].data;
		return TW_OK;
	}
	return fail_array(name, error);
}

static bool has_array(const struct tw_array *arrays, size_t count, const char *name)
{
	for (size_t i = 0; i < count; i++)
		if (!strcmp(arrays[i].name, name))
			return true;
	return false;
}

/* Weights of which the sum, and coverages. */
static enum tw_status check_edges(const uint64_t *weight, const float *coverage, uint32_t count, const char *name,
				  struct tw_error *error)
{
	uint64_t total = 0;
	for (uint32_t e = 0; e < count; e++) {
		if (!(coverage[e] >= 0 && coverage[e] <= 1))
			return fail_array(name, error);
		if (weight[e] != FIELD_FORBIDDEN &&
		    (__builtin_add_overflow(total, weight[e], &total) || total >= UINT64_C(1) << 61))
			return fail_array(name, error);
	}
	return TW_OK;
}

static enum tw_status check_values(const struct field *field, struct tw_error *error)
{
	if (!(field->scale > 0 && isfinite(field->scale)))
		return fail_array("scale", error);
	for (uint32_t f = 0; f < field->face_count; f++)
		if (!(field->density[f] >= 0 && isfinite(field->density[f])))
			return fail_array("density", error);
	enum tw_status status = check_edges(field->weight, field->coverage, field->edge_count, "weight", error);
	if (status == TW_OK && field->chord_weight)
		status = check_edges(field->chord_weight, field->chord_coverage, field->edge_count, "chord_weight",
				     error);
	return status;
}

enum tw_status field_from_arrays(struct field *field, const struct garment *garment, const struct topology *topology,
				 const struct tw_array *arrays, size_t count, const struct field_options *options,
				 struct tw_error *error)
{
	const void *density, *weight, *coverage, *scale, *chord_weight = NULL, *chord_coverage = NULL;
	enum tw_status status = find_array(&density, arrays, count, "density", TW_F64, garment->face_count, error);
	if (status == TW_OK)
		status = find_array(&weight, arrays, count, "weight", TW_U64, topology->edge_count, error);
	if (status == TW_OK)
		status = find_array(&coverage, arrays, count, "coverage", TW_F32, topology->edge_count, error);
	if (status == TW_OK)
		status = find_array(&scale, arrays, count, "scale", TW_F64, 1, error);
	if (status == TW_OK && has_array(arrays, count, "chord_weight"))
		status = find_array(&chord_weight, arrays, count, "chord_weight", TW_U64, topology->edge_count, error);
	if (status == TW_OK && chord_weight)
		status = find_array(&chord_coverage, arrays, count, "chord_coverage", TW_F32, topology->edge_count,
				    error);
	if (status != TW_OK)
		return status;
	*field = (struct field){
		.face_count = garment->face_count,
		.edge_count = topology->edge_count,
		.options = *options,
		.density = density,
		.weight = weight,
		.coverage = coverage,
		.chord_weight = chord_weight,
		.chord_coverage = chord_coverage,
	};
	memcpy(&field->scale, scale, sizeof field->scale);
	return check_values(field, error);
}

void field_warn_of_no_motion(const struct field *field, struct warning_list *warnings)
{
	if (field->options.weight != FIELD_DEFORMATION)
		return;
	for (uint32_t f = 0; f < field->face_count; f++) {
		if (field->density[f] > 0)
			return;
	}
	warning_add_whole(
		warnings, "field-without-motions",
		"no motion shapes this field: nothing deforms in it, so that wires are priced by eta and their "
		"length alone; give it motions");
}
