/* MDD (LightWave Motion Designer), big-endian. The times of the frames stand before the first of them. */
#include "solver/motion/reader.h"

#include <math.h>

/* Reads the times and derives the frame rate: they must not run backwards. */
static enum tw_status read_times(struct motion_reader *reader, uint32_t frames, struct tw_error *error)
{
	double first = 0, before = 0;
	for (uint32_t i = 0; i < frames; i++) {
		unsigned char bytes[4];
		enum tw_status status = reader_fill(reader, bytes, sizeof bytes, error);
		if (status != TW_OK)
			return status;
		double time = (double)float_of(load_be32(bytes));
		char where[32];
		snprintf(where, sizeof where, "frame %u", i);
		if (!isfinite(time) || (i > 0 && time < before))
			return tw_fail(
				error, TW_ERROR_INPUT, "motion-bad-times", where,
				"the time of frame %u is not a number or lies before that of the frame before it", i);
		first = i == 0 ? time : first;
		before = time;
	}
	reader->info.frames_per_second = before > first ? (frames - 1) / (before - first) : 30;
	return TW_OK;
}

static enum tw_status start(struct motion_reader *reader, struct tw_error *error)
{
	unsigned char header[8];
	size_t got = 0;
	enum tw_status status = reader_read(reader, header, sizeof header, &got, error);
	if (status != TW_OK)
		return status;
	if (got < sizeof header)
		return tw_fail(error, TW_ERROR_INPUT, "motion-truncated", "byte 0",
			       "an MDD file has a header of 8 bytes, this one has %zu bytes in all", got);
	int32_t frames = (int32_t)load_be32(header), vertices = (int32_t)load_be32(header + 4);
	status = reader_check(reader, vertices, frames, sizeof header, 4 + 12 * (uint64_t)(vertices > 0 ? vertices : 0),
			      error);
	if (status != TW_OK)
		return status;
	reader->info.vertex_count = (uint32_t)vertices;
	reader->info.frame_count = (uint32_t)frames;
	return read_times(reader, (uint32_t)frames, error);
}

static enum tw_status next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	*end = reader->frame == reader->info.frame_count;
	if (*end)
		return reader_expect_end(reader, error);
	const size_t count = 3 * (size_t)reader->info.vertex_count;
	enum tw_status status = reader_fill(reader, positions, count * sizeof *positions, error);
	for (size_t i = 0; i < count && status == TW_OK; i++)
		positions[i] = float_of(load_be32((const unsigned char *)&positions[i]));
	return status;
}

const struct motion_codec mdd_codec = {.start = start, .next = next};
