/* From one or two soups to a garment in millimetres.
 *
 * With a separate flat pattern the two files are matched face by face and corner by corner: the pattern's vertices are
 * the garment's pattern positions. Polygons are cut in the pattern, where they are flat. */
#include "solver/garment/draft.h"

#include "solver/garment/correspondence.h"

#include <math.h>

/* A garment is smaller than a kilometre; what is larger has a wrong unit, and squares of it would lose precision. */
static const double coordinate_limit_mm = 1e6;

enum tw_status fail_at_face(const struct draft *draft, uint32_t face, const char *type, const char *format, ...)
{
	char where[64];
	const uint32_t *line = draft->worn->polygon_line, polygon = garment_file_face(&draft->garment, face);
	if (line)
		snprintf(where, sizeof where, "face %u, line %u", polygon, line[polygon]);
	else
		snprintf(where, sizeof where, "face %u", polygon);
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(draft->error, TW_ERROR_INPUT, type, where, format, arguments);
	va_end(arguments);
	return TW_ERROR_INPUT;
}

double draft_face_cross(const struct draft *draft, uint32_t face)
{
	const uint32_t *coord = draft->garment.face_coord + 3 * (size_t)face;
	const double *a = draft->garment.pattern + 2 * (size_t)coord[0];
	const double *b = draft->garment.pattern + 2 * (size_t)coord[1];
	const double *c = draft->garment.pattern + 2 * (size_t)coord[2];
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static enum tw_status check_match(const struct draft *draft, const struct soup *worn, const struct soup *pattern)
{
	if (!pattern)
		return worn->corner_coord
			       ? TW_OK
			       : tw_fail(draft->error, TW_ERROR_INPUT, "pattern-missing", NULL,
					 "the mesh has no flat pattern: give every corner of an OBJ a `vt`, or "
					 "send a flat mesh with the same faces as the part `pattern`");
	if (worn->polygon_count != pattern->polygon_count)
		return tw_fail(
			draft->error, TW_ERROR_INPUT, "pattern-face-count", NULL,
			"the worn mesh has %u faces, the flat pattern %u; they must have the same faces in the same "
			"order",
			worn->polygon_count, pattern->polygon_count);
	for (uint32_t p = 0; p < worn->polygon_count; p++) {
		uint32_t here = worn->polygon_start[p + 1] - worn->polygon_start[p];
		uint32_t there = pattern->polygon_start[p + 1] - pattern->polygon_start[p];
		char where[32];
		snprintf(where, sizeof where, "face %u", p);
		if (here != there)
			return tw_fail(draft->error, TW_ERROR_INPUT, "pattern-face-differs", where,
				       "face %u has %u corners in the worn mesh and %u in the flat pattern", p, here,
				       there);
	}
	return TW_OK;
}

static double unit_mm(int unit)
{
	return unit == UNIT_M ? 1000 : unit == UNIT_CM ? 10 : 1;
}

static enum tw_status scale_positions(struct draft *draft, const struct soup *worn, double scale)
{
	struct garment *garment = &draft->garment;
	garment->vertex_count = worn->vertex_count;
	garment->source_count = worn->vertex_count;
	garment->position = ARENA_ARRAY(draft->arena, 3 * (size_t)worn->vertex_count, double);
	if (!garment->position)
		return tw_fail_memory(draft->error);
	for (size_t i = 0; i < 3 * (size_t)worn->vertex_count; i++) {
		garment->position[i] = scale * worn->position[i];
		if (fabs(garment->position[i]) <= coordinate_limit_mm)
			continue;
		char where[32];
		snprintf(where, sizeof where, "vertex %zu", i / 3);
		return tw_fail(draft->error, TW_ERROR_INPUT, "coordinate-too-large", where,
			       "vertex %zu lies %g mm away from the origin; check the unit", i / 3,
			       garment->position[i]);
	}
	return TW_OK;
}

/* The flat mesh of a separate pattern lies in its x y plane; anything else is a worn mesh sent by mistake. */
static enum tw_status check_flat(const struct draft *draft, const struct soup *pattern)
{
	double low = INFINITY, high = -INFINITY, width = 0;
	for (uint32_t v = 0; v < pattern->vertex_count; v++) {
		const double *p = pattern->position + 3 * (size_t)v;
		low = fmin(low, p[2]);
		high = fmax(high, p[2]);
		width = fmax(width, fmax(fabs(p[0] - pattern->position[0]), fabs(p[1] - pattern->position[1])));
	}
	if (pattern->vertex_count > 0 && high - low > 1e-3 * width)
		return tw_fail(draft->error, TW_ERROR_INPUT, "pattern-not-flat", NULL,
			       "the flat pattern has z from %g to %g; lay it into the x y plane", low, high);
	return TW_OK;
}

static enum tw_status scale_pattern(struct draft *draft, const struct soup *worn, const struct soup *pattern,
				    const struct import_options *options)
{
	struct garment *garment = &draft->garment;
	enum tw_status status = pattern ? check_flat(draft, pattern) : TW_OK;
	if (status != TW_OK)
		return status;
	bool sheet = options->pattern_unit == UNIT_SHEET;
	double scale_u = sheet ? options->sheet_width_mm : unit_mm(options->pattern_unit);
	double scale_v = sheet ? options->sheet_height_mm : unit_mm(options->pattern_unit);
	const double *from = pattern ? pattern->position : worn->coord;
	size_t stride = pattern ? 3 : 2;
	garment->coord_count = pattern ? pattern->vertex_count : worn->coord_count;
	garment->pattern = ARENA_ARRAY(draft->arena, 2 * (size_t)garment->coord_count, double);
	if (!garment->pattern)
		return tw_fail_memory(draft->error);
	for (size_t c = 0; c < garment->coord_count; c++) {
		double *to = garment->pattern + 2 * c;
		to[0] = scale_u * from[stride * c];
		to[1] = scale_v * from[stride * c + 1];
		if (fabs(to[0]) <= coordinate_limit_mm && fabs(to[1]) <= coordinate_limit_mm)
			continue;
		char where[48];
		snprintf(where, sizeof where, "pattern position %zu", c);
		return tw_fail(draft->error, TW_ERROR_INPUT, "coordinate-too-large", where,
			       "pattern position %zu is (%g, %g) mm; check the pattern's unit", c, to[0], to[1]);
	}
	return TW_OK;
}

/* Corners of polygon `p` as triangles behind face_count. */
static void add_polygon(struct draft *draft, const struct soup *worn, const uint32_t *corner_coord, uint32_t p)
{
	struct garment *garment = &draft->garment;
	uint32_t start = worn->polygon_start[p], count = worn->polygon_start[p + 1] - start;
	uint32_t triangles[3 * POLYGON_CORNERS] = {0, 1, 2};
	if (count > 3) {
		double xy[2 * POLYGON_CORNERS];
		for (uint32_t i = 0; i < count; i++) {
			xy[2 * i] = garment->pattern[2 * (size_t)corner_coord[start + i]];
			xy[2 * i + 1] = garment->pattern[2 * (size_t)corner_coord[start + i] + 1];
		}
		polygon_cut(xy, count, triangles); /* a polygon that cannot be cut gives faces that the checks refuse */
		warning_add(&draft->report->warnings, "polygons-cut", "face", p,
			    "faces with more than three corners were cut into triangles; their numbers stay those of "
			    "the file");
	}
	for (uint32_t t = 0; t < count - 2; t++) {
		size_t face = garment->face_count++;
		garment->file_face[face] = p;
		for (size_t k = 0; k < 3; k++) {
			garment->face_vertex[3 * face + k] = worn->corner_vertex[start + triangles[3 * t + k]];
			garment->face_coord[3 * face + k] = corner_coord[start + triangles[3 * t + k]];
		}
	}
}

enum tw_status draft_from_soup(struct draft *draft, const struct soup *worn, const struct soup *pattern,
			       const struct import_options *options)
{
	struct garment *garment = &draft->garment;
	draft->worn = worn;
	draft->labels = pattern && !worn->polygon_label[LABEL_GROUP] ? pattern : worn;
	if (worn->polygon_count == 0)
		return tw_fail(draft->error, TW_ERROR_INPUT, "mesh-empty", NULL, "the file has no faces");
	enum tw_status status = draft_check_unit(draft, worn, pattern, options);
	if (status == TW_OK)
		status = check_match(draft, worn, pattern);
	if (status == TW_OK)
		status = scale_positions(draft, worn, unit_mm(options->unit));
	if (status == TW_OK)
		status = scale_pattern(draft, worn, pattern, options);
	if (status != TW_OK)
		return status;

	uint64_t faces = (uint64_t)worn->corner_count - 2 * (uint64_t)worn->polygon_count;
	status = check_counts(0, faces, draft->error);
	if (status != TW_OK)
		return status;
	garment->face_vertex = ARENA_ARRAY(draft->arena, 3 * faces, uint32_t);
	garment->face_coord = ARENA_ARRAY(draft->arena, 3 * faces, uint32_t);
	garment->file_face = ARENA_ARRAY(draft->arena, faces, uint32_t);
	garment->file_face_count = worn->polygon_count;
	if (!garment->face_vertex || !garment->face_coord || !garment->file_face)
		return tw_fail_memory(draft->error);
	const uint32_t *corner_coord = pattern ? pattern->corner_vertex : worn->corner_coord;
	for (uint32_t p = 0; p < worn->polygon_count; p++)
		add_polygon(draft, worn, corner_coord, p);
	return draft_check_scale(draft, options);
}

enum tw_status draft_number_faces(struct draft *draft)
{
	struct garment *garment = &draft->garment;
	if (garment->file_face_count == garment->face_count) {
		garment->file_face = NULL; /* triangles, all of them */
		return TW_OK;
	}
	garment->file_corner = ARENA_ARRAY(draft->arena, 3 * (size_t)garment->file_face_count, uint32_t);
	if (!garment->file_corner)
		return tw_fail_memory(draft->error);
	for (uint32_t f = 0; f < garment->face_count; f++) {
		uint32_t polygon = garment->file_face[f];
		const uint32_t *start = draft->worn->polygon_start + polygon;
		for (size_t k = 0; k < 3; k++)
			garment->file_corner[3 * (size_t)polygon + k] =
				start[1] - start[0] == 3 ? garment->face_vertex[3 * (size_t)f + k] : GARMENT_NONE;
	}
	return TW_OK;
}
