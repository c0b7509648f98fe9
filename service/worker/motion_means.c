/* A motion, streamed from its upload, into mean strain densities. */
#include "service/worker/motion_means.h"

#include "service/worker/motion_source.h"

const char *const motion_mean_names[STRAIN_MODELS] = {"mean_stvk", "mean_printed", "mean_tension"};

/* What part of the job's progress this motion is. */
struct share {
	struct work *work;
	double from, to;
	double frame_count; /* 0 where it is not known beforehand */
};

static int tell_frames(void *context, uint32_t frames_done)
{
	const struct share *share = context;
	double part = share->frame_count > 0 ? frames_done / share->frame_count : 0.5;
	pulse_tell(share->work->pulse, share->from + (share->to - share->from) * part, "frames", NULL);
	return work_is_stopped(share->work);
}

enum tw_status motion_means(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			    const struct field_options *options, double share_from, double share_to,
			    double *mean[STRAIN_MODELS], struct motion_info *info, double *size, struct tw_error *error)
{
	struct blob_source source;
	struct motion_reader *reader = NULL;
	struct means_report report = {0};
	struct share share = {.work = work, .from = share_from, .to = share_to};
	for (int model = 0; model < STRAIN_MODELS; model++) {
		mean[model] = ARENA_ARRAY(work->arena, mesh->garment.face_count, double);
		if (!mean[model])
			return tw_fail_memory(error);
	}
	enum tw_status status = motion_source_open(&reader, &source, work->store, mesh, motion_id, error);
	if (status == TW_OK) {
		*info = *motion_info(reader);
		share.frame_count = info->frame_count;
		status = means_of_motion(mean, &report, work->arena, &mesh->garment, reader, options, tell_frames,
					 &share, error);
		info->frame_count = report.frame_count;
		if (size)
			*size = report.size;
	}
	motion_close(reader);
	blob_source_clear(&source);
	return status;
}

enum tw_status motion_mean(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			   const struct field_options *options, double share_from, double share_to, double **mean,
			   struct tw_error *error)
{
	double *means[STRAIN_MODELS];
	struct motion_info info;
	if (options->reference == FIELD_REFERENCE_PATTERN)
		return cache_read_doubles(work->arena, work->store, motion_id, motion_mean_names[options->energy],
					  mesh->garment.face_count, mean, error);
	enum tw_status status =
		motion_means(work, mesh, motion_id, options, share_from, share_to, means, &info, NULL, error);
	if (status == TW_OK)
		*mean = means[options->energy];
	return status;
}
