/* The frames of every motion pass once; of each, only the vertices under the curves are read. A layout has a row for
 * each branch, and a last one for the whole wire, whose length is the sum of theirs. */
#include "solver/layout/metrics.h"

#include "solver/field/field.h"
#include "solver/motion/motion.h"

#include <stdbool.h>

/* How one layout is carried along. */
struct carried {
	struct layout_metrics *metrics;
	const struct trace *trace;
	uint32_t branch_count;   /* row branch_count is the whole wire */
	struct elongation *cell; /* [branch_count + 1][motion_count]; mean holds the sum while frames come */
	double *rest_mm;         /* [branch_count + 1] what lengths are compared with */
	double *length_mm;       /* [branch_count + 1] in the frame at hand */
};

/* The stream of frames that all layouts are carried by. */
struct stream {
	const struct layout_input *input;
	struct carried *carried; /* [layout_count] */
	uint32_t layout_count;
	enum field_reference over;
	float *frame; /* [garment_source_count][3] as the file has it */
	float *moved; /* [vertex_count][3] where the garment has it otherwise */
};

/* Where the curve's points are in a frame, or, without one, as the garment is worn. */
static void place_in(const struct garment *garment, const struct place *place, const float *positions, double point[3])
{
	if (positions)
		place_in_frame(garment, place, positions, point);
	else
		place_on_worn(garment, place, point);
}

/* Lengths of the branches and of the whole wire. */
static void measure(const struct carried *carried, const struct garment *garment, const float *positions,
		    double *length_mm)
{
	const struct trace *trace = carried->trace;
	double whole = 0;
	for (uint32_t b = 0; b < carried->branch_count; b++) {
		double length = 0, last[3], here[3];
		for (uint32_t i = trace->first[b]; i < trace->first[b + 1]; i++) {
			place_in(garment, &trace->place[i], positions, here);
			double square = 0;
			for (int k = 0; k < 3; k++) {
				double d = i > trace->first[b] ? here[k] - last[k] : 0;
				square += d * d;
				last[k] = here[k];
			}
			length += sqrt(square);
		}
		length_mm[b] = length;
		whole += length;
	}
	length_mm[carried->branch_count] = whole;
}

static void rest_on_pattern(struct carried *carried)
{
	double whole = 0;
	for (uint32_t b = 0; b < carried->branch_count; b++) {
		carried->rest_mm[b] = carried->trace->rest_mm[b];
		whole += carried->rest_mm[b];
	}
	carried->rest_mm[carried->branch_count] = whole;
}

static void take_frame(struct carried *carried, const struct stream *stream, uint32_t motion, const float *positions)
{
	measure(carried, stream->input->garment, positions, carried->length_mm);
	for (uint32_t row = 0; row <= carried->branch_count; row++) {
		double rest = carried->rest_mm[row];
		double stretch = rest > 0 ? carried->length_mm[row] / rest - 1 : 0;
		stretch = stretch > 0 ? stretch : 0; /* shortening counts as none */
		struct elongation *cell = &carried->cell[(size_t)row * stream->input->motion_count + motion];
		cell->mean += stretch;
		cell->max = stretch > cell->max ? stretch : cell->max;
	}
}

/* The next frame's positions, NULL at the end. */
static enum tw_status next_frame(const struct stream *stream, struct motion_reader *reader, const float **positions,
				 struct tw_error *error)
{
	const struct layout_input *input = stream->input;
	bool end = false;
	enum tw_status status = motion_next(reader, stream->frame, &end, error);
	*positions = NULL;
	if (status != TW_OK || end)
		return status;
	if (input->cancelled && input->cancelled(input->context))
		return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the layout was cancelled");
	*positions = garment_frame(input->garment, stream->frame, stream->moved);
	return TW_OK;
}

/* Lengths in the frame of this motion that is the reference; the reader stands at the first frame again. */
static enum tw_status rest_in_frame(const struct stream *stream, struct motion_reader *reader, uint32_t motion,
				    struct tw_error *error)
{
	const uint32_t number = stream->input->field->options.reference_frame;
	for (uint32_t i = 0; i <= number; i++) {
		const float *positions;
		enum tw_status status = next_frame(stream, reader, &positions, error);
		if (status != TW_OK)
			return status;
		if (!positions)
			return tw_fail(error, TW_ERROR_INPUT, "reference-frame", NULL,
				       "the motion %.64s has %u frame%s, so there is no frame %u; choose a "
				       "reference_frame below %u",
				       stream->input->motion_name[motion], i, i == 1 ? "" : "s", number, i);
		for (uint32_t l = 0; i == number && l < stream->layout_count; l++)
			measure(&stream->carried[l], stream->input->garment, positions, stream->carried[l].rest_mm);
	}
	return motion_rewind(reader, error);
}

static enum tw_status take_frames(const struct stream *stream, struct motion_reader *reader, uint32_t motion,
				  uint32_t *frames, struct tw_error *error)
{
	for (*frames = 0;; ++*frames) {
		const float *positions;
		enum tw_status status = next_frame(stream, reader, &positions, error);
		if (status != TW_OK || !positions)
			return status;
		for (uint32_t l = 0; l < stream->layout_count; l++)
			take_frame(&stream->carried[l], stream, motion, positions);
	}
}

static enum tw_status take_motion(const struct stream *stream, uint32_t motion, struct tw_error *error)
{
	const struct layout_input *input = stream->input;
	struct motion_reader *reader = NULL;
	uint32_t frames = 0;
	enum tw_status status = input->motion_open(input->context, motion, &reader, error);
	if (status == TW_OK && stream->over == FIELD_REFERENCE_FRAME)
		status = rest_in_frame(stream, reader, motion, error);
	if (status == TW_OK)
		status = take_frames(stream, reader, motion, &frames, error);
	motion_close(reader);
	for (uint32_t l = 0; l < stream->layout_count; l++)
		for (uint32_t row = 0; frames > 0 && row <= stream->carried[l].branch_count; row++)
			stream->carried[l].cell[(size_t)row * input->motion_count + motion].mean /= frames;
	return status;
}

/* Of the motions that have frames: the largest of all, and the mean of their means. */
static struct elongation over_motions(const struct elongation *by_motion, uint32_t motion_count)
{
	struct elongation all = {0, 0};
	uint32_t counted = 0;
	for (uint32_t m = 0; m < motion_count; m++) {
		if (isnan(by_motion[m].max))
			continue;
		all.mean += by_motion[m].mean;
		all.max = by_motion[m].max > all.max ? by_motion[m].max : all.max;
		counted++;
	}
	all.mean = counted ? all.mean / counted : 0;
	return all;
}

static void finish(const struct carried *carried, uint32_t motion_count)
{
	for (uint32_t row = 0; row <= carried->branch_count; row++) {
		struct branch_metrics *figures =
			row < carried->branch_count ? &carried->metrics->branch[row] : &carried->metrics->total;
		figures->by_motion = &carried->cell[(size_t)row * motion_count];
		figures->elongation = over_motions(figures->by_motion, motion_count);
	}
}

static enum tw_status carried_init(struct carried *carried, const struct stream *stream, struct arena *arena,
				   struct tw_error *error)
{
	const size_t rows = (size_t)carried->branch_count + 1;
	carried->cell = ARENA_ZEROED(arena, rows * stream->input->motion_count, struct elongation);
	carried->rest_mm = ARENA_ARRAY(arena, rows, double);
	carried->length_mm = ARENA_ARRAY(arena, rows, double);
	if (!carried->cell || !carried->rest_mm || !carried->length_mm)
		return tw_fail_memory(error);
	if (stream->over == FIELD_REFERENCE_PATTERN)
		rest_on_pattern(carried);
	if (stream->over == FIELD_REFERENCE_WORN)
		measure(carried, stream->input->garment, NULL, carried->rest_mm);
	return TW_OK;
}

static void leave_out(const struct stream *stream, uint32_t motion)
{
	for (uint32_t l = 0; l < stream->layout_count; l++)
		for (uint32_t row = 0; row <= stream->carried[l].branch_count; row++)
			stream->carried[l].cell[(size_t)row * stream->input->motion_count + motion] =
				(struct elongation){NAN, NAN};
}

enum field_reference metrics_elongation_over(const struct layout_input *input)
{
	switch ((enum layout_elongation_over)input->request->options.elongation_over) {
	case ELONGATION_OVER_PATTERN:
		return FIELD_REFERENCE_PATTERN;
	case ELONGATION_OVER_WORN:
		return FIELD_REFERENCE_WORN;
	case ELONGATION_OVER_FRAME:
		return FIELD_REFERENCE_FRAME;
	default:
		return (enum field_reference)input->field->options.reference;
	}
}

enum tw_status metrics_elongation(struct layout_metrics *const *metrics, const struct trace *const *trace,
				  const struct branch_set *const *branches, uint32_t layout_count,
				  const struct layout_input *input, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = input->garment;
	struct stream stream = {
		.input = input,
		.carried = ARENA_ZEROED(arena, layout_count, struct carried),
		.layout_count = layout_count,
		.over = metrics_elongation_over(input),
		.frame = ARENA_ARRAY(arena, 3 * (size_t)garment_source_count(garment), float),
		.moved = ARENA_ARRAY(arena, 3 * (size_t)garment->vertex_count, float),
	};
	if (!stream.carried || !stream.frame || !stream.moved)
		return tw_fail_memory(error);
	enum tw_status status = TW_OK;
	for (uint32_t l = 0; l < layout_count && status == TW_OK; l++) {
		stream.carried[l] = (struct carried){
			.metrics = metrics[l], .trace = trace[l], .branch_count = branches[l]->branch_count};
		status = carried_init(&stream.carried[l], &stream, arena, error);
	}
	for (uint32_t m = 0; m < input->motion_count && status == TW_OK; m++) {
		if (layout_has_frames(input, m))
			status = take_motion(&stream, m, error);
		else
			leave_out(&stream, m);
	}
	for (uint32_t l = 0; l < layout_count && status == TW_OK; l++)
		finish(&stream.carried[l], input->motion_count);
	return status;
}
