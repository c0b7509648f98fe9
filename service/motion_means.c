/* A motion's frames, streamed from its upload, into mean strain densities. */
#include "service/motion_means.h"

#include "service/blob_source.h"
#include "solver/motion/fit.h"

#include <string.h>

const char *const motion_mean_names[STRAIN_MODELS] = {"mean_stvk", "mean_printed", "mean_tension"};

/* A motion being read: its stream, and a frame of the file where the garment has other vertices. */
struct frames {
	struct blob_source source;
	struct motion_reader *reader;
	const struct garment *garment;
	float *frame; /* [source_count][3]; NULL where a frame is the garment's vertices as it stands */
};

static enum tw_status open_frames(struct frames *frames, struct work *work, const struct cached_mesh *mesh,
				  const char *motion_id, struct tw_error *error)
{
	struct byte_source stream;
	memset(frames, 0, sizeof *frames);
	frames->garment = &mesh->garment;
	uint32_t points = garment_source_count(&mesh->garment);
	if (mesh->garment.source_vertex) {
		frames->frame = ARENA_ARRAY(work->arena, 3 * (size_t)points, float);
		if (!frames->frame)
			return tw_fail_memory(error);
	}
	enum tw_status status = blob_source_init(&frames->source, work->store, motion_id, "motion", &stream, error);
	if (status != TW_OK)
		return status;
	return motion_open(&frames->reader, &stream, MOTION_SNIFF, (enum length_unit)mesh->options.unit, points, error);
}

static void close_frames(struct frames *frames)
{
	motion_close(frames->reader);
	blob_source_clear(&frames->source);
}

/* The next frame as vertices of the garment. */
static enum tw_status next_frame(struct frames *frames, float *position, bool *end, struct tw_error *error)
{
	enum tw_status status = motion_next(frames->reader, frames->frame ? frames->frame : position, end, error);
	if (status == TW_OK && !*end && frames->frame)
		garment_frame(frames->garment, frames->frame, position);
	return status;
}

static enum tw_status rest_from_frame(struct strain_rest *rest, struct frames *frames, struct work *work,
				      uint32_t number, struct tw_error *error)
{
	bool end = false;
	float *position = ARENA_ARRAY(work->arena, 3 * (size_t)frames->garment->vertex_count, float);
	if (!position)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i <= number && !end; i++) {
		enum tw_status status = next_frame(frames, position, &end, error);
		if (status != TW_OK)
			return status;
	}
	if (end)
		return tw_fail(error, TW_ERROR_INPUT, "no-such-frame", "/options/reference_frame",
			       "a motion has no frame %u; count from 0", number);
	enum tw_status status = strain_rest_from_frame(rest, work->arena, frames->garment, position, error);
	return status == TW_OK ? motion_rewind(frames->reader, error) : status;
}

static enum tw_status make_rest(struct strain_rest *rest, struct frames *frames, struct work *work,
				const struct field_options *options, struct tw_error *error)
{
	switch ((enum field_reference)options->reference) {
	case FIELD_REFERENCE_WORN:
		return strain_rest_from_worn(rest, work->arena, frames->garment, error);
	case FIELD_REFERENCE_FRAME:
		return rest_from_frame(rest, frames, work, options->reference_frame, error);
	case FIELD_REFERENCE_PATTERN:
		break;
	}
	return strain_rest_from_pattern(rest, work->arena, frames->garment, error);
}

static enum tw_status add_frames(struct frames *frames, struct work *work, struct strain_mean *mean, double share_from,
				 double share_to, uint32_t *frame_count, struct tw_error *error)
{
	bool end = false;
	double whole = motion_info(frames->reader)->frame_count;
	for (*frame_count = 0;; ++*frame_count) {
		float *position = strain_mean_slot(mean);
		double part = whole > 0 ? *frame_count / whole : 0.5;
		enum tw_status status = work_step(work, share_from + (share_to - share_from) * part, "frames", error);
		if (status == TW_OK)
			status = next_frame(frames, position, &end, error);
		if (status == TW_OK && !end && *frame_count == 0)
			status = motion_check_fit(frames->garment, position, error);
		if (status != TW_OK || end)
			return status;
		strain_mean_add(mean);
	}
}

enum tw_status motion_means(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			    const struct field_options *options, double share_from, double share_to,
			    double *mean[STRAIN_MODELS], struct motion_info *info, struct tw_error *error)
{
	struct frames frames;
	struct strain_rest rest;
	struct strain_mean *sums = NULL;
	uint32_t frame_count = 0;
	for (int model = 0; model < STRAIN_MODELS; model++) {
		mean[model] = ARENA_ARRAY(work->arena, mesh->garment.face_count, double);
		if (!mean[model])
			return tw_fail_memory(error);
	}
	struct arena_mark mark = arena_mark(work->arena);
	enum tw_status status = open_frames(&frames, work, mesh, motion_id, error);
	if (status == TW_OK)
		status = make_rest(&rest, &frames, work, options, error);
	if (status == TW_OK)
		status = strain_mean_new(&sums, work->arena, &rest, error);
	if (status == TW_OK)
		status = add_frames(&frames, work, sums, share_from, share_to, &frame_count, error);
	if (status == TW_OK) {
		strain_mean_finish(sums, mean);
		if (info) {
			*info = *motion_info(frames.reader);
			info->frame_count = frame_count;
		}
	}
	close_frames(&frames);
	arena_release(work->arena, mark);
	return status;
}
