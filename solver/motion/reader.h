/* What the readers of the formats share: a format is a row of functions, which motion.c opens and dispatches to. */
#ifndef SOLVER_MOTION_READER_H
#define SOLVER_MOTION_READER_H

#include "solver/motion/info.h"
#include "solver/motion/source.h"

#include <math.h>
#include <stdbool.h>

struct motion_reader;

struct motion_codec {
	/* Reads the header from the start of the stream and fills info; may be called again after a rewind. */
	enum tw_status (*start)(struct motion_reader *reader, struct tw_error *error);
	/* The next frame in the file's unit, unchecked; *end at the end of the stream, which it has seen. */
	enum tw_status (*next)(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error);
	void (*close)(void *state); /* NULL where there is none */
};

extern const struct motion_codec pc2_codec, mdd_codec, obj_tar_codec, packed_codec;

struct motion_reader {
	struct byte_source source;
	const struct motion_codec *codec;
	struct motion_info info;
	uint32_t expected; /* vertices; 0 for any */
	uint32_t frame;    /* the next one */
	float scale;       /* millimetres in the file's unit */
	bool rounds;       /* positions to what packing keeps of them */
	void *state;       /* of the codec, owned; NULL for none */
};

/* Fills all of `bytes`. *got says how many there were; fewer than `size` is no error here. */
enum tw_status reader_read(struct motion_reader *reader, void *bytes, size_t size, size_t *got,
			   struct tw_error *error) TW_NODISCARD;

/* As reader_read, but fewer are the error "motion-truncated". */
enum tw_status reader_fill(struct motion_reader *reader, void *bytes, size_t size, struct tw_error *error) TW_NODISCARD;

/* The error "motion-truncated" in the frame in hand. */
enum tw_status reader_truncated(const struct motion_reader *reader, struct tw_error *error) TW_NODISCARD;

/* Checks the counts of a header against the limits and what is expected. */
enum tw_status reader_check_counts(const struct motion_reader *reader, int64_t vertices, int64_t frames,
				   struct tw_error *error) TW_NODISCARD;

/* As reader_check_counts, and against the size of the stream: `header` bytes and `per_frame` bytes a frame. */
enum tw_status reader_check(const struct motion_reader *reader, int64_t vertices, int64_t frames, uint64_t header,
			    uint64_t per_frame, struct tw_error *error) TW_NODISCARD;

/* Nothing may stand behind the last frame. */
enum tw_status reader_expect_end(struct motion_reader *reader, struct tw_error *error) TW_NODISCARD;

/* The grid of packed motions: a coordinate's place on it, and back. Within a kilometre both fit. */
enum { GRID_PER_MM = 64 };

static inline int32_t grid_place(float mm)
{
	return (int32_t)lrintf(mm * GRID_PER_MM);
}

static inline float grid_position(int32_t place)
{
	return (float)place / GRID_PER_MM;
}

static inline uint32_t load_le32(const unsigned char *bytes)
{
	return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline uint32_t load_be32(const unsigned char *bytes)
{
	return (uint32_t)bytes[3] | (uint32_t)bytes[2] << 8 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[0] << 24;
}

static inline float float_of(uint32_t bits)
{
	float value;
	__builtin_memcpy(&value, &bits, sizeof value);
	return value;
}

#endif
