/* The frames of every motion pass once; of each, only the vertices under the curves are read. */
#include "solver/layout/metrics.h"

#include "solver/motion/motion.h"

/* How one layout is carried along. */
struct carried {
	struct layout_metrics *metrics;
	const struct trace *trace;
	uint32_t branch_count;
	uint32_t motion_count;
	struct elongation *cell; /* [branch_count][motion_count] mean holds the sum while frames come */
	double rest_mm;          /* of all branches */
};

static double carried_length(const struct garment *garment, const struct trace *trace, uint32_t branch,
			     const float *positions)
{
	double length = 0, last[3], here[3];
	for (uint32_t i = trace->first[branch]; i < trace->first[branch + 1]; i++) {
		place_in_frame(garment, &trace->place[i], positions, here);
		double square = 0;
		for (int k = 0; k < 3; k++) {
			double d = i > trace->first[branch] ? here[k] - last[k] : 0;
			square += d * d;
			last[k] = here[k];
		}
		length += sqrt(square);
	}
	return length;
}

static void take_frame(struct carried *carried, const struct garment *garment, uint32_t motion, const float *positions)
{
	for (uint32_t b = 0; b < carried->branch_count; b++) {
		double rest = carried->trace->rest_mm[b];
		if (!(rest > 0))
			continue;
		double stretch = carried_length(garment, carried->trace, b, positions) / rest - 1;
		stretch = stretch > 0 ? stretch : 0;
		struct elongation *cell = &carried->cell[(size_t)b * carried->motion_count + motion];
		cell->mean += stretch;
		cell->max = stretch > cell->max ? stretch : cell->max;
	}
}

static void finish_motion(struct carried *carried, uint32_t motion, uint32_t frames)
{
	for (uint32_t b = 0; b < carried->branch_count && frames; b++)
		carried->cell[(size_t)b * carried->motion_count + motion].mean /= frames;
}

/* Over the motions by their frames; over the branches by their lengths. */
static void finish(struct carried *carried, const uint32_t *frames)
{
	struct elongation total = {0, 0};
	for (uint32_t b = 0; b < carried->branch_count; b++) {
		struct branch_metrics *branch = &carried->metrics->branch[b];
		branch->by_motion = &carried->cell[(size_t)b * carried->motion_count];
		double sum = 0, count = 0;
		for (uint32_t m = 0; m < carried->motion_count; m++) {
			sum += branch->by_motion[m].mean * frames[m];
			count += frames[m];
			if (branch->by_motion[m].max > branch->elongation.max)
				branch->elongation.max = branch->by_motion[m].max;
		}
		branch->elongation.mean = count > 0 ? sum / count : 0;
		total.mean += branch->elongation.mean * carried->trace->rest_mm[b];
		total.max = branch->elongation.max > total.max ? branch->elongation.max : total.max;
	}
	total.mean = carried->rest_mm > 0 ? total.mean / carried->rest_mm : 0;
	carried->metrics->total.elongation = total;
}

static enum tw_status stream(struct carried *carried, uint32_t layout_count, const struct layout_input *input,
			     uint32_t motion, float *frame, float *moved, uint32_t *frames, struct tw_error *error)
{
	struct motion_reader *reader = NULL;
	enum tw_status status = input->motion_open(input->context, motion, &reader, error);
	*frames = 0;
	while (!status) {
		bool end = false;
		status = motion_next(reader, frame, &end, error);
		if (status || end)
			break;
		if (input->cancelled && input->cancelled(input->context)) {
			status = tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the layout was cancelled");
			break;
		}
		const float *positions = garment_frame(input->garment, frame, moved);
		for (uint32_t l = 0; l < layout_count; l++)
			take_frame(&carried[l], input->garment, motion, positions);
		*frames += 1;
	}
	motion_close(reader);
	for (uint32_t l = 0; l < layout_count; l++)
		finish_motion(&carried[l], motion, *frames);
	return status;
}

/* Motions as rows of the whole layout: max over branches, mean by length. */
static enum tw_status total_by_motion(struct carried *carried, struct arena *arena, struct tw_error *error)
{
	struct elongation *row = ARENA_ZEROED(arena, carried->motion_count, struct elongation);
	if (!row)
		return tw_fail_memory(error);
	for (uint32_t m = 0; m < carried->motion_count; m++) {
		for (uint32_t b = 0; b < carried->branch_count; b++) {
			const struct elongation *cell = &carried->cell[(size_t)b * carried->motion_count + m];
			row[m].max = cell->max > row[m].max ? cell->max : row[m].max;
			if (carried->rest_mm > 0)
				row[m].mean += cell->mean * carried->trace->rest_mm[b] / carried->rest_mm;
		}
	}
	carried->metrics->total.by_motion = row;
	return TW_OK;
}

enum tw_status metrics_elongation(struct layout_metrics *const *metrics, const struct trace *const *trace,
				  const struct branch_set *const *branches, uint32_t layout_count,
				  const struct layout_input *input, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = input->garment;
	struct carried *carried = ARENA_ZEROED(arena, layout_count, struct carried);
	float *frame = ARENA_ARRAY(arena, 3 * (size_t)garment_source_count(garment), float);
	float *moved = ARENA_ARRAY(arena, 3 * (size_t)garment->vertex_count, float);
	uint32_t *frames = ARENA_ZEROED(arena, input->motion_count, uint32_t);
	if (!carried || !frame || !moved || !frames)
		return tw_fail_memory(error);
	for (uint32_t l = 0; l < layout_count; l++) {
		uint32_t count = branches[l]->branch_count;
		carried[l] = (struct carried){metrics[l], trace[l], count, input->motion_count, NULL, 0};
		carried[l].cell = ARENA_ZEROED(arena, (size_t)count * input->motion_count, struct elongation);
		if (!carried[l].cell)
			return tw_fail_memory(error);
		for (uint32_t b = 0; b < count; b++)
			carried[l].rest_mm += trace[l]->rest_mm[b];
	}
	for (uint32_t m = 0; m < input->motion_count; m++) {
		enum tw_status status = stream(carried, layout_count, input, m, frame, moved, &frames[m], error);
		if (status)
			return status;
	}
	for (uint32_t l = 0; l < layout_count; l++) {
		finish(&carried[l], frames);
		enum tw_status status = total_by_motion(&carried[l], arena, error);
		if (status)
			return status;
	}
	return TW_OK;
}
