/* The job that makes a mesh: the uploads into a checked garment. */
#include "service/worker/work.h"
#include "solver/garment/import.h"
#include "storage/blob.h"

#include <string.h>

/* A whole upload in the arena. TW_ERROR_NOT_FOUND where there is no such part. */
static enum tw_status read_upload(struct work *work, const char *part, struct garment_source *source,
				  struct tw_error *error)
{
	struct blob blob;
	size_t got = 0;
	enum tw_status status = blob_find(work->store, work->resource->id, BLOB_UPLOAD, part, &blob, error);
	if (status != TW_OK)
		return status;
	char *name = ARENA_ARRAY(work->arena, sizeof blob.file_name, char);
	char *bytes = ARENA_ARRAY(work->arena, (size_t)blob.size, char);
	if (!name || !bytes)
		return tw_fail(error, TW_ERROR_LIMIT, "mesh-too-large", NULL,
			       "the file of %llu bytes does not fit into the worker's memory limit",
			       (unsigned long long)blob.size);
	memcpy(name, blob.file_name, sizeof blob.file_name);
	status = blob_read(work->store, blob.number, 0, bytes, (size_t)blob.size, &got, error);
	*source = (struct garment_source){bytes, got, MESH_SNIFF, name[0] ? name : NULL};
	return status;
}

static json_t *number_list(const double *values, size_t count)
{
	json_t *list = json_array();
	for (size_t i = 0; i < count; i++)
		json_array_append_new(list, json_real(values[i]));
	return list;
}

static json_t *show_box(const double *least, const double *largest, size_t axes)
{
	return json_pack("{s:o, s:o}", "least", number_list(least, axes), "largest", number_list(largest, axes));
}

static json_t *show_pieces(const struct garment *garment)
{
	json_t *pieces = json_array();
	for (uint32_t i = 0; i < garment->piece_count; i++)
		json_array_append_new(pieces, json_string(garment->piece_name[i]));
	return pieces;
}

static json_t *show_garment(const struct garment *garment, const struct garment_report *report)
{
	static const char *const formats[] = {"unknown", "obj", "ply", "off", "stl"};
	json_int_t edges = (json_int_t)report->inner_edges + report->seam_edges + report->hem_edges;
	return json_pack("{s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:o, s:o, s:o, s:f, s:f, s:o}", "format",
			 formats[report->format], "vertices", (json_int_t)garment->vertex_count, "faces",
			 (json_int_t)garment->face_count, "file_vertices", (json_int_t)report->file_vertices,
			 "file_faces", (json_int_t)report->polygon_count, "edges", edges, "seam_edges",
			 (json_int_t)report->seam_edges, "hem_edges", (json_int_t)report->hem_edges, "components",
			 (json_int_t)report->component_count, "motion_points",
			 (json_int_t)garment_source_count(garment), "pieces", show_pieces(garment), "worn_box_mm",
			 show_box(report->worn_box_mm[0], report->worn_box_mm[1], 3), "pattern_box_mm",
			 show_box(report->pattern_box_mm[0], report->pattern_box_mm[1], 2), "worn_area_mm2",
			 report->worn_area_mm2, "pattern_area_mm2", report->pattern_area_mm2, "warnings",
			 warning_list_show(&report->warnings));
}

static enum tw_status import(struct work *work, const struct garment_source *worn, const struct garment_source *pattern,
			     struct tw_error *error)
{
	struct import_options options;
	struct garment garment;
	struct topology topology;
	struct garment_report report;
	enum tw_status status = cache_read_options(&import_option_table, &options, work->resource->options, error);
	if (status == TW_OK)
		status = work_step(work, 0.2, "checking", error);
	if (status == TW_OK)
		status = garment_import(&garment, work->arena, worn, pattern, &options, &report, error);
	if (status == TW_OK)
		status = topology_build(&topology, work->arena, &garment, error);
	if (status != TW_OK)
		return status;
	struct tw_array *arrays = ARENA_ARRAY(work->arena, GARMENT_ARRAYS, struct tw_array);
	if (!arrays)
		return tw_fail_memory(error);
	status = garment_to_arrays(&garment, &topology, work->arena, arrays, &work->result.array_count, error);
	work->result.arrays = arrays;
	return status == TW_OK ? work_summary(work, show_garment(&garment, &report), error) : status;
}

enum tw_status job_import_mesh(struct work *work, struct tw_error *error)
{
	struct garment_source worn;
	struct garment_source pattern;
	enum tw_status status = work_step(work, 0, "reading", error);
	if (status == TW_OK)
		status = read_upload(work, "worn", &worn, error);
	if (status != TW_OK)
		return status;
	status = read_upload(work, "pattern", &pattern, error);
	if (status != TW_OK && status != TW_ERROR_NOT_FOUND)
		return status;
	return import(work, &worn, status == TW_OK ? &pattern : NULL, error);
}
