/* PC2, as 3ds Max, Maya and Blender write it. Frames are read straight into the caller's array. */
#include "solver/motion/motion.h"
#include "solver/motion/reader.h"

#include <math.h>
#include <string.h>

static const char magic[12] = "POINTCACHE2"; /* with its terminating 0 */

static enum tw_status start(struct motion_reader *reader, struct tw_error *error)
{
	unsigned char header[PC2_HEADER_BYTES];
	size_t got = 0;
	enum tw_status status = reader_read(reader, header, sizeof header, &got, error);
	if (status != TW_OK)
		return status;
	if (got < sizeof header)
		return tw_fail(error, TW_ERROR_INPUT, "motion-truncated", "byte 0",
			       "a PC2 file has a header of 32 bytes, this one has %zu bytes in all", got);
	if (memcmp(header, magic, sizeof magic) != 0)
		return tw_fail(error, TW_ERROR_INPUT, "motion-bad-header", "byte 0",
			       "a PC2 file begins with POINTCACHE2 and a zero byte");
	int32_t version = (int32_t)load_le32(header + 12), vertices = (int32_t)load_le32(header + 16);
	float first = float_of(load_le32(header + 20)), rate = float_of(load_le32(header + 24));
	int32_t frames = (int32_t)load_le32(header + 28);
	if (version != 1)
		return tw_fail(error, TW_ERROR_INPUT, "motion-bad-header", "byte 12",
			       "PC2 version %d is unknown; 1 is read", version);
	if (!isfinite(first) || !(rate > 0) || !isfinite(rate))
		return tw_fail(error, TW_ERROR_INPUT, "motion-bad-header", "byte 20",
			       "start frame and sample rate must be numbers, the rate positive");
	status = reader_check(reader, vertices, frames, sizeof header, 12 * (uint64_t)(vertices > 0 ? vertices : 0),
			      error);
	if (status != TW_OK)
		return status;
	reader->info.vertex_count = (uint32_t)vertices;
	reader->info.frame_count = (uint32_t)frames;
	reader->info.start_frame = (double)first;
	reader->info.frames_per_second = 30 / (double)rate;
	return TW_OK;
}

static enum tw_status next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	*end = reader->frame == reader->info.frame_count;
	if (*end)
		return reader_expect_end(reader, error);
	const size_t count = 3 * (size_t)reader->info.vertex_count;
	enum tw_status status = reader_fill(reader, positions, count * sizeof *positions, error);
	if (__BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__) {
		for (size_t i = 0; i < count && status == TW_OK; i++)
			positions[i] = float_of(load_le32((const unsigned char *)&positions[i]));
	}
	return status;
}

const struct motion_codec pc2_codec = {.start = start, .next = next};

static void store_le32(unsigned char *bytes, uint32_t value)
{
	for (int i = 0; i < 4; i++)
		bytes[i] = (unsigned char)(value >> 8 * i);
}

size_t pc2_write_header(void *bytes, uint32_t vertex_count, uint32_t frame_count)
{
	unsigned char *header = bytes;
	uint32_t one;
	memcpy(&one, &(float){1}, sizeof one);
	memcpy(header, magic, sizeof magic);
	store_le32(header + 12, 1);
	store_le32(header + 16, vertex_count);
	store_le32(header + 20, 0);
	store_le32(header + 24, one);
	store_le32(header + 28, frame_count);
	return PC2_HEADER_BYTES;
}
