#include "solver/field/means.h"

#include "solver/motion/fit.h"

#include <string.h>

struct stream {
	const struct garment *garment;
	struct motion_reader *reader;
	float *frame; /* [garment_source_count][3] as the file has it */
	float *moved; /* [vertex_count][3], where the garment has other vertices than the file */
};

/* The garment's vertices in the next frame; NULL at the end. */
static enum tw_status next_frame(struct stream *stream, const float **positions, struct tw_error *error)
{
	bool end = false;
	enum tw_status status = motion_next(stream->reader, stream->frame, &end, error);
	*positions = status || end ? NULL : garment_frame(stream->garment, stream->frame, stream->moved);
	return status;
}

/* The rest shape from a frame of this motion; the reader stands at its first frame before and after. */
static enum tw_status rest_from_frame(struct strain_rest *rest, struct stream *stream, struct arena *arena,
				      uint32_t number, struct tw_error *error)
{
	const float *positions = NULL;
	for (uint32_t i = 0; i <= number; i++) {
		enum tw_status status = next_frame(stream, &positions, error);
		if (status)
			return status;
		if (!positions)
			return tw_fail(error, TW_ERROR_INPUT, "reference-frame", NULL,
				       "the motion has %u frames, so there is no frame %u to refer to", i, number);
	}
	enum tw_status status = strain_rest_from_frame(rest, arena, stream->garment, positions, error);
	return status ? status : motion_rewind(stream->reader, error);
}

static enum tw_status find_rest(struct strain_rest *rest, struct stream *stream, struct arena *arena,
				const struct field_options *options, struct tw_error *error)
{
	if (options->reference == FIELD_REFERENCE_WORN)
		return strain_rest_from_worn(rest, arena, stream->garment, error);
	if (options->reference == FIELD_REFERENCE_FRAME)
		return rest_from_frame(rest, stream, arena, options->reference_frame, error);
	return strain_rest_from_pattern(rest, arena, stream->garment, error);
}

static enum tw_status add_frames(struct strain_mean *mean, struct stream *stream, means_progress *progress,
				 void *context, struct tw_error *error)
{
	size_t bytes = 3 * (size_t)stream->garment->vertex_count * sizeof(float);
	for (uint32_t done = 1;; done++) {
		const float *positions;
		enum tw_status status = next_frame(stream, &positions, error);
		if (status || !positions)
			return status;
		if (done == 1)
			status = motion_check_fit(stream->garment, positions, error);
		if (status)
			return status;
		memcpy(strain_mean_slot(mean), positions, bytes);
		strain_mean_add(mean);
		if (progress && progress(context, done))
			return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the reading was cancelled");
	}
}

enum tw_status means_of_motion(double *const means[STRAIN_MODELS], uint32_t *frame_count, struct arena *arena,
			       const struct garment *garment, struct motion_reader *reader,
			       const struct field_options *options, means_progress *progress, void *context,
			       struct tw_error *error)
{
	struct arena_mark mark = arena_mark(arena);
	struct stream stream = {.garment = garment, .reader = reader};
	stream.frame = ARENA_ARRAY(arena, 3 * (size_t)garment_source_count(garment), float);
	stream.moved = ARENA_ARRAY(arena, 3 * (size_t)garment->vertex_count, float);
	struct strain_rest rest;
	struct strain_mean *mean;
	enum tw_status status = stream.frame && stream.moved ? TW_OK : tw_fail_memory(error);
	if (!status)
		status = find_rest(&rest, &stream, arena, options, error);
	if (!status)
		status = strain_mean_new(&mean, arena, &rest, error);
	if (!status)
		status = add_frames(mean, &stream, progress, context, error);
	if (!status) {
		*frame_count = strain_mean_finish(mean, means);
		if (*frame_count == 0)
			status = tw_fail(error, TW_ERROR_INPUT, "motion-empty", NULL, "the motion has no frames");
	}
	arena_release(arena, mark);
	return status;
}
