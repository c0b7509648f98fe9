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
			    double *mean[STRAIN_MODELS], struct motion_info *info, struct warning_list *warnings,
			    struct tw_error *error)
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
		if (warnings)
			*warnings = report.warnings;
	}
	motion_close(reader);
	blob_source_clear(&source);
	return status;
}

/* Whether what a motion keeps is what this release would keep. */
static enum tw_status means_are_of_today(struct work *work, const char *motion_id, bool *yes, struct tw_error *error)
{
	struct resource motion = {0};
	enum tw_status status = resource_get(work->store, TENANT_ANY, RESOURCE_MOTION, motion_id, &motion, error);
	*yes = motion.version == resource_kind_row(RESOURCE_MOTION)->version;
	resource_clear(&motion);
	return status;
}

static enum tw_status refuse_outdated(struct work *work, const char *motion_id, struct tw_error *error)
{
	bool has_frames = false;
	enum tw_status status = motion_has_frames(work->store, motion_id, &has_frames, error);
	if (status == TW_OK && !has_frames)
		status = tw_fail(error, TW_ERROR_INPUT, "motion-outdated", NULL,
				 "an earlier release read the motion %s, this one measures its strain differently, and "
				 "no frames of it were kept; send the motion again",
				 motion_id);
	return status;
}

/* As the import makes them: no option of a field but the reference changes a mean. */
static enum tw_status means_against_pattern(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
					    double share_from, double share_to, double *mean[STRAIN_MODELS],
					    struct tw_error *error)
{
	struct field_options usual;
	struct motion_info info;
	option_defaults(&field_option_table, &usual);
	enum tw_status status = refuse_outdated(work, motion_id, error);
	if (status != TW_OK)
		return status;
	return motion_means(work, mesh, motion_id, &usual, share_from, share_to, mean, &info, NULL, error);
}

enum tw_status motion_mean(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			   const struct field_options *options, uint32_t field_version, double share_from,
			   double share_to, double **mean, struct tw_error *error)
{
	double *means[STRAIN_MODELS];
	struct motion_info info;
	bool usable = true, over_pattern = options->reference == FIELD_REFERENCE_PATTERN;
	enum tw_status status = TW_OK;
	if (over_pattern && field_version == resource_kind_row(RESOURCE_FIELD)->version)
		status = means_are_of_today(work, motion_id, &usable, error);
	if (status == TW_OK && over_pattern && usable)
		return cache_read_doubles(work->arena, work->store, motion_id, motion_mean_names[options->energy],
					  mesh->garment.face_count, mean, error);
	if (status == TW_OK)
		status = over_pattern ? means_against_pattern(work, mesh, motion_id, share_from, share_to, means, error)
				      : motion_means(work, mesh, motion_id, options, share_from, share_to, means, &info,
						     NULL, error);
	if (status == TW_OK)
		*mean = means[options->energy];
	return status;
}
