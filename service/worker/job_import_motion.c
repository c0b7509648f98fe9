/* The job that makes a motion: reads every frame once, checks it, and keeps the mean strain densities of the three
 * energy models, so that a field of any set of motions needs no frames. The frames are kept packed, or as they came, or
 * not at all, as the options say. */
#include "service/worker/motion_means.h"
#include "service/worker/motion_source.h"
#include "solver/motion/options.h"
#include "solver/motion/pack.h"
#include "storage/upload.h"

#include <string.h>

#define MEANS_SHARE 0.8 /* of the job's time, about; the rest packs */

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

static json_t *show_motion(const struct motion_info *info, const struct warning_list *warnings, double *const *mean,
			   uint32_t face_count)
{
	static const char *const formats[] = {"unknown", "pc2", "mdd", "obj-tar", "packed"};
	const double *stvk = mean[STRAIN_STVK];
	return json_pack("{s:s, s:I, s:I, s:f, s:f, s:f, s:o}", "format", formats[info->format], "frames",
			 (json_int_t)info->frame_count, "points", (json_int_t)info->vertex_count, "frames_per_second",
			 info->frames_per_second, "average_density_mpa", average(stvk, face_count),
			 "largest_density_mpa", largest(stvk, face_count), "warnings", warning_list_show(warnings));
}

/* Where packed frames go: an upload of our own, because they may be larger than memory. */
struct packing {
	struct work *work;
	struct upload *upload;
	double parts, part_count; /* written: a header, and two of each frame; of how many, 0 where that is not known */
};

static enum tw_status write_packed(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	struct packing *packing = context;
	if (work_is_stopped(packing->work))
		return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the job was asked to stop");
	double done = packing->part_count > 0 ? packing->parts++ / packing->part_count : 0.5;
	pulse_tell(packing->work->pulse, MEANS_SHARE + (1 - MEANS_SHARE) * done, "packing", NULL);
	return upload_write(packing->upload, bytes, size, error);
}

static enum tw_status pack(struct packing *packing, const struct cached_mesh *mesh, struct tw_error *error)
{
	struct work *work = packing->work;
	struct blob_source source;
	struct motion_reader *reader = NULL;
	uint32_t frames = 0;
	enum tw_status status = motion_source_open(&reader, &source, work->store, mesh, work->resource->id, error);
	if (status == TW_OK)
		status = motion_pack(reader, write_packed, packing, &frames, error);
	if (status == TW_OK)
		status = upload_seal(packing->upload, error);
	motion_close(reader);
	blob_source_clear(&source);
	return status;
}

/* The result takes the packed frames over. Where the job fails, the store's sweep removes them. */
static enum tw_status keep_packed(struct work *work, const struct cached_mesh *mesh, const struct motion_info *info,
				  struct tw_error *error)
{
	/* No key's, so that nobody's limit stops it half way. */
	const struct owner owner = {work->resource->owner.tenant, 0};
	struct packing packing = {.work = work, .part_count = 1 + 2.0 * info->frame_count};
	char *id = ARENA_ARRAY(work->arena, STORE_ID_SIZE, char);
	if (!id)
		return tw_fail_memory(error);
	enum tw_status status = work_step(work, MEANS_SHARE, "packing", error);
	if (status == TW_OK)
		status = upload_begin(&packing.upload, work->store, owner, "frames", "", "application/octet-stream",
				      TW_LIMIT_UPLOAD_BYTES, error);
	if (status == TW_OK)
		status = pack(&packing, mesh, error);
	if (status == TW_OK) {
		memcpy(id, upload_id(packing.upload), STORE_ID_SIZE);
		work->result.upload = id;
		work->result.dropped_part = "motion";
	}
	upload_free(packing.upload);
	return status;
}

static enum tw_status keep_frames(struct work *work, const struct cached_mesh *mesh, const struct motion_info *info,
				  struct tw_error *error)
{
	struct motion_options options;
	enum tw_status status = cache_read_options(&motion_option_table, &options, work->resource->options, error);
	bool packed_already = options.frames == FRAMES_PACKED && info->format == MOTION_PACKED;
	if (status != TW_OK || options.frames == FRAMES_UPLOAD || packed_already)
		return status;
	if (options.frames == FRAMES_PACKED)
		return keep_packed(work, mesh, info, error);
	work->result.dropped_part = "motion";
	return TW_OK;
}

enum tw_status job_import_motion(struct work *work, struct tw_error *error)
{
	char mesh_id[STORE_ID_SIZE];
	const struct cached_mesh *mesh = NULL;
	struct field_options options;
	struct motion_info info;
	struct warning_list warnings = {0};
	double *mean[STRAIN_MODELS];
	option_defaults(&field_option_table, &options);
	enum tw_status status = work_find_mesh(work, work->resource->id, mesh_id, error);
	if (status == TW_OK)
		status = cache_mesh(work->cache, work->store, mesh_id, &mesh, error);
	if (status == TW_OK)
		status = motion_means(work, mesh, work->resource->id, &options, 0, MEANS_SHARE, mean, &info, &warnings,
				      error);
	if (status == TW_OK)
		status = keep_frames(work, mesh, &info, error);
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
	return work_summary(work, show_motion(&info, &warnings, mean, mesh->garment.face_count), error);
}
