/* The job that makes a motion: reads every frame once, checks it, and keeps the mean strain densities of the three
 * energy models, so that a field of any set of motions needs no frames. The frames themselves stay in the upload. */
#include "service/motion_means.h"

static double largest(const double *values, uint32_t count)
{
	double most = 0;
	for (uint32_t i = 0; i < count; i++)
		most = values[i] > most ? values[i] : most;
	return most;
}

static double average(const double *values, uint32_t count)
{
	double sum = 0;
	for (uint32_t i = 0; i < count; i++)
		sum += values[i];
	return count ? sum / count : 0;
}

static json_t *show_motion(const struct motion_info *info, double *const *mean, uint32_t face_count)
{
	static const char *const formats[] = {"unknown", "pc2", "mdd", "obj-tar", "packed"};
	const double *stvk = mean[STRAIN_STVK];
	return json_pack("{s:s, s:I, s:I, s:f, s:f, s:f}", "format", formats[info->format], "frames",
			 (json_int_t)info->frame_count, "points", (json_int_t)info->vertex_count, "frames_per_second",
			 info->frames_per_second, "average_density_mpa", average(stvk, face_count),
			 "largest_density_mpa", largest(stvk, face_count));
}

enum tw_status job_import_motion(struct work *work, struct tw_error *error)
{
	char mesh_id[STORE_ID_SIZE];
	const struct cached_mesh *mesh = NULL;
	struct field_options options;
	struct motion_info info;
	double *mean[STRAIN_MODELS];
	option_defaults(&field_option_table, &options);
	enum tw_status status = work_find_mesh(work, work->resource->id, mesh_id, error);
	if (status == TW_OK)
		status = cache_mesh(work->cache, work->store, mesh_id, &mesh, error);
	if (status == TW_OK)
		status = motion_means(work, mesh, work->resource->id, &options, 0, 1, mean, &info, error);
	if (status != TW_OK)
		return status;
	struct tw_array *arrays = ARENA_ARRAY(work->arena, STRAIN_MODELS, struct tw_array);
	if (!arrays)
		return tw_fail_memory(error);
	for (int model = 0; model < STRAIN_MODELS; model++)
		arrays[model] =
			(struct tw_array){motion_mean_names[model], TW_F64, 1, mesh->garment.face_count, mean[model]};
	work->result.arrays = arrays;
	work->result.array_count = STRAIN_MODELS;
	return work_summary(work, show_motion(&info, mean, mesh->garment.face_count), error);
}
