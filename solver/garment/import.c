/* The import as a list of stages, all in a scratch arena; the garment is copied out at the end. */
#include "solver/garment/import.h"

#include "solver/foreign.h"
#include "solver/garment/draft.h"
#include "solver/garment/refine.h"

#include <math.h>
#include <string.h>
#include <strings.h>

/* Enough for the largest garment that tightwire.h allows, and a bound for a worker. */
static const size_t scratch_bytes = (size_t)2 << 30;

enum mesh_format mesh_format_of_name(const char *name)
{
	static const struct {
		const char *ending;
		enum mesh_format format;
	} endings[] = {{".obj", MESH_OBJ}, {".ply", MESH_PLY}, {".off", MESH_OFF}, {".stl", MESH_STL}};
	const char *ending = name ? strrchr(name, '.') : NULL;
	for (size_t i = 0; ending && i < sizeof endings / sizeof *endings; i++) {
		if (strcasecmp(ending, endings[i].ending) == 0)
			return endings[i].format;
	}
	return MESH_SNIFF;
}

/* OBJ has no mark of its own: it is what is left. */
static enum mesh_format format_of(const struct garment_source *source, struct text file)
{
	enum mesh_format format = source->format == MESH_SNIFF ? mesh_format_of_name(source->name) : source->format;
	if (format != MESH_SNIFF)
		return format;
	return ply_is(file) ? MESH_PLY : off_is(file) ? MESH_OFF : stl_is(file) ? MESH_STL : MESH_OBJ;
}

static enum tw_status read_soup(struct soup *soup, struct arena *arena, const struct garment_source *source,
				enum mesh_format *format, struct garment_report *report, struct tw_error *error)
{
	struct text file = {source->bytes, (const char *)source->bytes + source->size};
	*format = format_of(source, file);
	if (source->size == 0)
		return tw_fail(error, TW_ERROR_INPUT, "mesh-empty", NULL, "the file is empty");
	const char *foreign = *format == MESH_STL ? NULL : foreign_kind(source->bytes, source->size);
	if (foreign)
		return tw_fail(error, TW_ERROR_INPUT, "mesh-unknown-format", "byte 0",
			       "the file is %s. Meshes are read as OBJ, PLY, OFF and STL", foreign);
	switch (*format) {
	case MESH_PLY:
		return ply_read(soup, arena, file, error);
	case MESH_OFF:
		return off_read(soup, arena, file, error);
	case MESH_STL:
		return stl_read(soup, arena, file, error);
	case MESH_SNIFF:
	case MESH_OBJ:
		break;
	}
	return obj_read(soup, arena, file, report, error);
}

static enum tw_status run_stages(struct draft *draft, const struct soup *worn, const struct soup *pattern,
				 const struct import_options *options)
{
	enum tw_status status = draft_from_soup(draft, worn, pattern, options);
	if (status == TW_OK)
		status = draft_connect(draft);
	if (status == TW_OK)
		status = draft_weld(draft, options->weld_mm);
	if (status == TW_OK)
		status = draft_warn_of_open_seams(draft, options->weld_mm);
	if (status == TW_OK)
		status = draft_find_pieces(draft);
	if (status == TW_OK)
		status = draft_check_faces(draft, (enum mirrored_pieces)options->mirrored_pieces);
	if (status == TW_OK)
		status = draft_check_overlap(draft);
	if (status == TW_OK)
		status = draft_check_thickness(draft);
	if (status == TW_OK)
		status = draft_number_faces(draft);
	return status;
}

static enum tw_status refine(struct draft *draft, const struct import_options *options)
{
	enum tw_status status = TW_OK;
	uint32_t levels = options->refinement == REFINE_NONE ? 0 : options->refine_levels;
	for (uint32_t level = 0; level < levels && status == TW_OK; level++) {
		struct garment coarse = draft->garment;
		status = garment_refine(&draft->garment, draft->arena, &coarse, &draft->topology,
					(enum refinement)options->refinement, draft->error);
		if (status == TW_OK)
			status = topology_build(&draft->topology, draft->arena, &draft->garment, draft->error);
	}
	return status;
}

static void write_box(const double *points, size_t count, size_t axes, double *low, double *high)
{
	for (size_t axis = 0; axis < axes; axis++) {
		low[axis] = count ? INFINITY : 0;
		high[axis] = count ? -INFINITY : 0;
	}
	for (size_t i = 0; i < count * axes; i++) {
		low[i % axes] = fmin(low[i % axes], points[i]);
		high[i % axes] = fmax(high[i % axes], points[i]);
	}
}

static void write_report(const struct draft *draft)
{
	const struct garment *garment = &draft->garment;
	struct garment_report *report = draft->report;
	report->polygon_count = draft->worn->polygon_count;
	report->file_vertices = draft->worn->vertex_count;
	uint32_t *by_kind[] = {&report->inner_edges, &report->seam_edges, &report->hem_edges};
	for (uint32_t e = 0; e < draft->topology.edge_count; e++)
		++*by_kind[draft->topology.edge_kind[e]];
	report->component_count = draft->topology.component_count;
	write_box(garment->position, garment->vertex_count, 3, report->worn_box_mm[0], report->worn_box_mm[1]);
	write_box(garment->pattern, garment->coord_count, 2, report->pattern_box_mm[0], report->pattern_box_mm[1]);
}

/* A copy of `size` bytes, NULL for none and when out of memory. */
static void *copy(struct arena *arena, const void *from, size_t count, size_t size, bool *failed)
{
	if (!from)
		return NULL;
	void *to = arena_array(arena, count, size);
	*failed |= !to;
	return to ? memcpy(to, from, count * size) : NULL;
}

static enum tw_status copy_garment(struct garment *to, struct arena *arena, const struct garment *from,
				   struct tw_error *error)
{
	bool failed = false;
	const size_t vertices = from->vertex_count, faces = from->face_count;
	*to = *from;
	to->position = copy(arena, from->position, 3 * vertices, sizeof *to->position, &failed);
	to->pattern = copy(arena, from->pattern, 2 * (size_t)from->coord_count, sizeof *to->pattern, &failed);
	to->face_vertex = copy(arena, from->face_vertex, 3 * faces, sizeof *to->face_vertex, &failed);
	to->face_coord = copy(arena, from->face_coord, 3 * faces, sizeof *to->face_coord, &failed);
	to->face_piece = copy(arena, from->face_piece, faces, sizeof *to->face_piece, &failed);
	to->source_vertex = copy(arena, from->source_vertex, 3 * vertices, sizeof *to->source_vertex, &failed);
	to->source_share = copy(arena, from->source_share, 3 * vertices, sizeof *to->source_share, &failed);
	to->mesh_vertex = copy(arena, from->mesh_vertex, from->source_count, sizeof *to->mesh_vertex, &failed);
	to->file_face = copy(arena, from->file_face, faces, sizeof *to->file_face, &failed);
	to->file_corner =
		copy(arena, from->file_corner, 3 * (size_t)from->file_face_count, sizeof *to->file_corner, &failed);
	to->piece_name = copy(arena, from->piece_name, from->piece_count, sizeof *to->piece_name, &failed);
	for (uint32_t i = 0; i < from->piece_count && !failed; i++)
		to->piece_name[i] = copy(arena, from->piece_name[i], strlen(from->piece_name[i]) + 1, 1, &failed);
	return failed ? tw_fail_memory(error) : TW_OK;
}

/* Says that the place of an error is one of the flat pattern's file. */
static void name_pattern(struct tw_error *error)
{
	char where[sizeof error->where];
	snprintf(where, sizeof where, "%s", error->where);
	snprintf(error->where, sizeof error->where, "pattern%s%.100s", where[0] ? ", " : "", where);
}

static enum tw_status import(struct draft *draft, const struct garment_source *worn,
			     const struct garment_source *pattern, const struct import_options *options)
{
	struct soup worn_soup, pattern_soup;
	enum mesh_format ignored;
	enum tw_status status =
		read_soup(&worn_soup, draft->arena, worn, &draft->report->format, draft->report, draft->error);
	if (status == TW_OK && pattern) {
		status = read_soup(&pattern_soup, draft->arena, pattern, &ignored, draft->report, draft->error);
		if (status != TW_OK)
			name_pattern(draft->error);
	}
	if (status == TW_OK)
		status = run_stages(draft, &worn_soup, pattern ? &pattern_soup : NULL, options);
	if (status == TW_OK)
		status = refine(draft, options);
	if (status == TW_OK)
		write_report(draft);
	return status;
}

enum tw_status garment_import(struct garment *garment, struct arena *arena, const struct garment_source *worn,
			      const struct garment_source *pattern, const struct import_options *options,
			      struct garment_report *report, struct tw_error *error)
{
	struct tw_error unread = {0};
	*report = (struct garment_report){0};
	struct draft draft = {.arena = arena_new(scratch_bytes), .report = report, .error = error ? error : &unread};
	if (!draft.arena)
		return tw_fail_memory(error);
	enum tw_status status = import(&draft, worn, pattern, options);
	if (status == TW_OK)
		status = copy_garment(garment, arena, &draft.garment, error);
	arena_free(draft.arena);
	return status;
}
