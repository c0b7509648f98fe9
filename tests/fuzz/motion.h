/* What the fuzz targets of the motion formats share: all frames, a rewind, and the first frame again. The first byte of
 * the input says whether the reader is told how long the stream is, and the unit. */
#ifndef TESTS_FUZZ_MOTION_H
#define TESTS_FUZZ_MOTION_H

#include "solver/motion/motion.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { MOTION_UNKNOWN_SIZE = 1, MOTION_UNIT_SHIFT = 1, MOTION_FRAMES = 100, MOTION_POINTS = 4096 };

static inline void check_frame(const float *positions, uint32_t points)
{
	for (size_t i = 0; i < 3 * (size_t)points; i++)
		if (!isfinite(positions[i]))
			__builtin_trap();
}

static inline void read_frames(struct motion_reader *reader, float *positions, uint32_t points)
{
	struct tw_error error = {0};
	enum tw_status status = TW_OK;
	bool end = false;
	for (int frame = 0; frame < MOTION_FRAMES && status == TW_OK && !end; frame++) {
		status = motion_next(reader, positions, &end, &error);
		if (status == TW_OK && !end)
			check_frame(positions, points);
	}
	if (status == TW_OK)
		status = motion_rewind(reader, &error);
	if (status == TW_OK)
		status = motion_next(reader, positions, &end, &error);
	if (status != TW_OK && !error.type)
		__builtin_trap();
}

static inline int fuzz_motion(const uint8_t *bytes, size_t size, enum motion_format format)
{
	if (size == 0)
		return 0;
	struct byte_memory memory = {bytes + 1, size - 1, 0};
	struct byte_source source = byte_source_memory(&memory);
	if (bytes[0] & MOTION_UNKNOWN_SIZE)
		source.size = UINT64_MAX;
	struct motion_reader *reader = NULL;
	struct tw_error error = {0};
	enum length_unit unit = (enum length_unit)((bytes[0] >> MOTION_UNIT_SHIFT) % 3);
	if (motion_open(&reader, &source, format, unit, 0, &error) != TW_OK) {
		if (!error.type)
			__builtin_trap();
		return 0;
	}
	/* More points than the input could fill: the frame is cut off, as it is with fewer. */
	uint32_t points = motion_info(reader)->vertex_count;
	float *positions = points <= MOTION_POINTS ? malloc(12 * (size_t)points) : NULL;
	if (positions)
		read_frames(reader, positions, points);
	free(positions);
	motion_close(reader);
	return 0;
}

#endif
