#include "solver/field/means.h"

#include "solver/motion/cloth.h"
#include "solver/motion/fit.h"

struct stream {
	const struct garment *garment;
	struct motion_reader *reader;
	float *frame; /* [garment_source_count][3] as the file has it, where that is not what the garment has */
};

/* Reads the garment's vertices in the next frame into `position`, [vertex_count][3]; not at the end. */
static enum tw_status next_frame(struct stream *stream, float *position, bool *end, struct tw_error *error)
{
	float *frame = stream->frame ? stream->frame : position;
	enum tw_status status = motion_next(stream->reader, frame, end, error);
	if (status == TW_OK && !*end)
		garment_frame(stream->garment, frame, position);
	return status;
}

/* The rest shape from a frame of this motion; the reader stands at its first frame before and after. */
static enum tw_status rest_from_frame(struct strain_rest *rest, struct stream *stream, struct arena *arena,
				      uint32_t number, struct tw_error *error)
{
	float *position = ARENA_ARRAY(arena, 3 * (size_t)stream->garment->vertex_count, float);
	if (!position)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i <= number; i++) {
		bool end = false;
		enum tw_status status = next_frame(stream, position, &end, error);
		if (status != TW_OK)
			return status;
		if (end)
			return tw_fail(
				error, TW_ERROR_INPUT, "reference-frame", NULL,
				"the motion has %u frame%s, so there is no frame %u; choose a reference_frame below %u",
				i, i == 1 ? "" : "s", number, i);
	}
	enum tw_status status = strain_rest_from_frame(rest, arena, stream->garment, position, error);
	return status != TW_OK ? status : motion_rewind(stream->reader, error);
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

static enum tw_status check_first(struct means_report *report, const struct garment *garment, const float *position,
				  struct tw_error *error)
{
	motion_warn_of_size(&report->warnings, motion_size(garment, position));
	return motion_check_fit(garment, position, error);
}

/* Suspect frames are judged edge by edge; the first that is refused counts. */
struct guard {
	struct cloth cloth;
	enum tw_status status;
	struct tw_error *error;
};

static void judge(void *context, uint32_t frame, const float *position)
{
	struct guard *guard = context;
	if (guard->status == TW_OK)
		guard->status = cloth_judge(&guard->cloth, frame, position, guard->error);
}

static enum tw_status watch_cloth(struct guard *guard, struct strain_mean *mean, struct means_report *report,
				  struct arena *arena, const struct garment *garment, struct tw_error *error)
{
	const size_t sides = 3 * (size_t)garment->face_count;
	*guard = (struct guard){.error = error};
	float *limit = ARENA_ARRAY(arena, sides, float);
	enum tw_status status = cloth_init(&guard->cloth, arena, garment, &report->warnings, error);
	if (status != TW_OK || !limit)
		return status != TW_OK ? status : tw_fail_memory(error);
	for (size_t i = 0; i < sides; i++)
		limit[i] = (float)(CLOTH_STRETCH_WARNED * CLOTH_STRETCH_WARNED) * guard->cloth.rest[i];
	strain_mean_watch(mean, &(struct strain_watch){limit, judge, guard});
	return TW_OK;
}

static enum tw_status add_frames(struct strain_mean *mean, struct means_report *report, struct guard *guard,
				 struct stream *stream, means_progress *progress, void *context, struct tw_error *error)
{
	for (uint32_t done = 1;; done++) {
		bool end = false;
		enum tw_status status = next_frame(stream, strain_mean_slot(mean), &end, error);
		if (status != TW_OK || end)
			return status;
		if (done == 1)
			status = check_first(report, stream->garment, strain_mean_slot(mean), error);
		if (status == TW_OK && stream->frame)
			status = cloth_judge_copies(&guard->cloth, done - 1, stream->frame, error);
		if (status != TW_OK)
			return status;
		strain_mean_add(mean);
		if (guard->status != TW_OK)
			return guard->status;
		if (progress && progress(context, done))
			return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the reading was cancelled");
	}
}

enum tw_status means_of_motion(double *const means[STRAIN_MODELS], struct means_report *report, struct arena *arena,
			       const struct garment *garment, struct motion_reader *reader,
			       const struct field_options *options, means_progress *progress, void *context,
			       struct tw_error *error)
{
	struct arena_mark mark = arena_mark(arena);
	*report = (struct means_report){0};
	struct stream stream = {.garment = garment, .reader = reader};
	struct strain_rest rest;
	struct strain_mean *mean;
	struct guard guard = {.status = TW_OK};
	if (garment->source_vertex) {
		stream.frame = ARENA_ARRAY(arena, 3 * (size_t)garment_source_count(garment), float);
		if (!stream.frame)
			return tw_fail_memory(error);
	}
	enum tw_status status = find_rest(&rest, &stream, arena, options, error);
	if (status == TW_OK)
		status = strain_mean_new(&mean, arena, &rest, error);
	if (status == TW_OK)
		status = watch_cloth(&guard, mean, report, arena, garment, error);
	if (status == TW_OK)
		status = add_frames(mean, report, &guard, &stream, progress, context, error);
	if (status == TW_OK) {
		report->frame_count = strain_mean_finish(mean, means);
		status = guard.status;
		cloth_warn(&guard.cloth);
		if (status == TW_OK && report->frame_count == 0)
			status = tw_fail(error, TW_ERROR_INPUT, "motion-empty", NULL,
					 "the motion has no frames; export at least one");
	}
	arena_release(arena, mark);
	return status;
}
