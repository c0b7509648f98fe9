#include "solver/motion/motion.h"

#include "solver/foreign.h"
#include "solver/motion/reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A wearer does not leave a kilometre; what does is damaged or has a wrong unit. */
static const float position_limit_mm = 1e6F;

/* By the first bytes; a tar has its mark at 257. MDD has no mark: it must begin with plausible counts. */
static enum motion_format sniff(const unsigned char *bytes, size_t size, uint32_t expected)
{
	if (size >= 12 && memcmp(bytes, "POINTCACHE2", 12) == 0)
		return MOTION_PC2;
	if (size >= 8 && memcmp(bytes, "TWFRAME1", 8) == 0)
		return MOTION_PACKED;
	if (size >= 262 && memcmp(bytes + 257, "ustar", 5) == 0)
		return MOTION_OBJ_TAR;
	if (size < 8)
		return MOTION_SNIFF;
	uint32_t frames = load_be32(bytes), vertices = load_be32(bytes + 4);
	bool plausible = frames >= 1 && frames <= TW_LIMIT_FRAMES && vertices >= 1 && vertices <= TW_LIMIT_VERTICES;
	return plausible && (expected == 0 || vertices == expected) ? MOTION_MDD : MOTION_SNIFF;
}

static enum tw_status find_format(struct motion_reader *reader, enum motion_format *format, struct tw_error *error)
{
	if (*format != MOTION_SNIFF)
		return TW_OK;
	unsigned char bytes[512];
	size_t got = 0;
	enum tw_status status = reader_read(reader, bytes, sizeof bytes, &got, error);
	if (status == TW_OK)
		status = reader->source.seek(reader->source.context, 0, error);
	if (status != TW_OK)
		return status;
	if (got == 0)
		return tw_fail(error, TW_ERROR_INPUT, "motion-empty", NULL,
			       "the file is empty; export the motion again");
	*format = sniff(bytes, got, reader->expected);
	const char *foreign = *format == MOTION_SNIFF ? foreign_kind(bytes, got) : NULL;
	if (*format == MOTION_SNIFF)
		return tw_fail(
			error, TW_ERROR_INPUT, "motion-unknown-format", "byte 0",
			"the file is %s%snone of PC2, MDD with the garment's vertices, a packed motion, and an OBJ "
			"sequence as an uncompressed tar",
			foreign ? foreign : "", foreign ? ". It is " : "");
	return TW_OK;
}

enum tw_status motion_open(struct motion_reader **opened, const struct byte_source *source, enum motion_format format,
			   enum length_unit unit, uint32_t vertex_count, struct tw_error *error)
{
	static const struct motion_codec *const codecs[] = {NULL, &pc2_codec, &mdd_codec, &obj_tar_codec,
							    &packed_codec};
	*opened = NULL;
	struct motion_reader *reader = calloc(1, sizeof *reader);
	if (!reader)
		return tw_fail_memory(error);
	reader->source = *source;
	reader->expected = vertex_count;
	reader->scale = unit == UNIT_M ? 1000 : unit == UNIT_CM ? 10 : 1;
	enum tw_status status = find_format(reader, &format, error);
	if (status == TW_OK) {
		reader->codec = codecs[format];
		reader->info.format = format;
		status = reader->codec->start(reader, error);
	}
	if (status != TW_OK) {
		motion_close(reader);
		return status;
	}
	*opened = reader;
	return TW_OK;
}

void motion_close(struct motion_reader *reader)
{
	if (reader && reader->codec && reader->codec->close)
		reader->codec->close(reader->state);
	free(reader);
}

const struct motion_info *motion_info(const struct motion_reader *reader)
{
	return &reader->info;
}

static enum tw_status bad_position(const struct motion_reader *reader, const float *positions, size_t from, size_t to,
				   struct tw_error *error)
{
	size_t i = from;
	while (i < to && fabsf(positions[i]) <= position_limit_mm)
		i++;
	char where[64];
	snprintf(where, sizeof where, "frame %u vertex %zu", reader->frame, i / 3);
	if (isfinite(positions[i]))
		return tw_fail(error, TW_ERROR_INPUT, "motion-too-far", where,
			       "a vertex lies %.10g mm from the origin, at most %.10g is accepted; import the motion "
			       "in its own unit "
			       "(mm, cm or m), or mend that frame",
			       (double)fabsf(positions[i]), (double)position_limit_mm);
	return tw_fail(error, TW_ERROR_INPUT, "motion-not-a-number", where,
		       "a coordinate is not a finite number; export the motion again");
}

/* To millimetres, and every coordinate a number; in pieces that stay in the cache. */
static enum tw_status scale_and_check(const struct motion_reader *reader, float *positions, struct tw_error *error)
{
	enum { PIECE = 4096 };
	const size_t count = 3 * (size_t)reader->info.vertex_count;
	const float scale = reader->scale;
	for (size_t from = 0; from < count; from += PIECE) {
		size_t to = from + PIECE < count ? from + PIECE : count;
		unsigned bad = 0;
		for (size_t i = from; i < to; i++) {
			positions[i] *= scale;
			bad |= !(fabsf(positions[i]) <= position_limit_mm);
		}
		if (bad)
			return bad_position(reader, positions, from, to, error);
	}
	return TW_OK;
}

enum tw_status motion_next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	*end = false;
	enum tw_status status = reader->codec->next(reader, positions, end, error);
	if (status != TW_OK || *end)
		return status;
	status = scale_and_check(reader, positions, error);
	for (size_t i = 0; reader->rounds && status == TW_OK && i < 3 * (size_t)reader->info.vertex_count; i++)
		positions[i] = grid_position(grid_place(positions[i]));
	reader->frame++;
	return status;
}

void motion_round(struct motion_reader *reader)
{
	reader->rounds = true;
}

enum tw_status motion_rewind(struct motion_reader *reader, struct tw_error *error)
{
	enum tw_status status = reader->source.seek(reader->source.context, 0, error);
	if (status != TW_OK)
		return status;
	reader->frame = 0;
	return reader->codec->start(reader, error);
}
