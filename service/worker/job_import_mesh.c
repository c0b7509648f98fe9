/* The job that makes a mesh: the uploads into a checked garment. */
#include "service/worker/mesh_upload.h"
#include "service/worker/work.h"

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

static enum tw_status import(struct work *work, const struct mesh_upload *upload, struct tw_error *error)
{
	struct import_options options;
	struct garment garment;
	struct topology topology;
	struct garment_report report;
	enum tw_status status = cache_read_options(&import_option_table, &options, work->resource->options, error);
	if (status == TW_OK)
		status = work_step(work, 0.2, "checking", error);
	if (status == TW_OK)
		status = garment_import(&garment, work->arena, &upload->worn,
					upload->has_pattern ? &upload->pattern : NULL, &options, &report, error);
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
	struct mesh_upload upload;
	enum tw_status status = work_step(work, 0, "reading", error);
	if (status == TW_OK)
		status = mesh_upload_read(&upload, work->arena, work->store, work->resource->id, error);
	return status == TW_OK ? import(work, &upload, error) : status;
}
