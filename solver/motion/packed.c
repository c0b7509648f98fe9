/* Packed motions; the format stands in pack.h. Packer and reader share the prediction, in wrapping 32-bit arithmetic,
 * so that a damaged file gives positions that are refused and no undefined behaviour. */
#include "solver/motion/pack.h"
#include "solver/motion/reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zstd.h>

enum { HEADER_BYTES = 24, LEVEL = 3 };
static const char magic[8] = {'T', 'W', 'F', 'R', 'A', 'M', 'E', '1'};

/* The two frames that predict the next, and room for one frame unpacked and packed. */
struct packing {
	uint32_t points;
	uint32_t frame;    /* how many were seen */
	uint32_t *last[2]; /* [3 * points] places on the grid, as two's complement: of the frame before, and before that
			    */
	unsigned char *planes; /* [12 * points] */
	unsigned char *packed; /* [packed_limit] */
	size_t packed_limit;
	void *zstd; /* ZSTD_CCtx or ZSTD_DCtx, owned by the user of this struct */
};

static void packing_clear(struct packing *packing)
{
	free(packing->last[0]);
	free(packing->last[1]);
	free(packing->planes);
	free(packing->packed);
}

static enum tw_status packing_init(struct packing *packing, uint32_t points, struct tw_error *error)
{
	size_t bytes = 12 * (size_t)points;
	*packing = (struct packing){.points = points, .packed_limit = ZSTD_compressBound(bytes)};
	packing->last[0] = malloc(bytes);
	packing->last[1] = malloc(bytes);
	packing->planes = malloc(bytes);
	packing->packed = malloc(packing->packed_limit);
	return packing->last[0] && packing->last[1] && packing->planes && packing->packed ? TW_OK
											  : tw_fail_memory(error);
}

/* Makes room for the next frame: the older of the two arrays becomes the one to fill. */
static uint32_t *packing_turn(struct packing *packing)
{
	uint32_t *oldest = packing->last[1];
	packing->last[1] = packing->last[0];
	packing->last[0] = oldest;
	packing->frame++;
	return oldest;
}

/* Where coordinate `i` of the frame in hand is expected. `grid` is that frame as far as it is known, and, from
 * coordinate i on, still the frame before the one before. */
static uint32_t predict(const struct packing *packing, const uint32_t *grid, size_t i)
{
	if (packing->frame == 1)
		return i >= 3 ? grid[i - 3] : 0;
	if (packing->frame == 2)
		return packing->last[1][i];
	return 2 * packing->last[1][i] - grid[i];
}

/* --- packing ----------------------------------------------------------------------------------- */

struct motion_packer {
	struct packing packing;
	motion_pack_write *write;
	void *context; /* borrowed */
};

static void store_le32(unsigned char *bytes, uint32_t value)
{
	for (int i = 0; i < 4; i++)
		bytes[i] = (unsigned char)(value >> 8 * i);
}

static enum tw_status write_header(const struct motion_packer *packer, const struct motion_info *info,
				   struct tw_error *error)
{
	unsigned char header[HEADER_BYTES] = {0};
	const float rate = (float)info->frames_per_second;
	uint32_t rate_bits;
	memcpy(&rate_bits, &rate, sizeof rate_bits);
	memcpy(header, magic, sizeof magic);
	store_le32(header + 8, info->vertex_count);
	store_le32(header + 12, info->frame_count);
	store_le32(header + 16, rate_bits);
	return packer->write(packer->context, header, sizeof header, error);
}

enum tw_status motion_packer_new(struct motion_packer **made, const struct motion_info *info, motion_pack_write *write,
				 void *context, struct tw_error *error)
{
	*made = NULL;
	struct motion_packer *packer = calloc(1, sizeof *packer);
	if (!packer)
		return tw_fail_memory(error);
	packer->write = write;
	packer->context = context;
	enum tw_status status = packing_init(&packer->packing, info->vertex_count, error);
	packer->packing.zstd = ZSTD_createCCtx();
	if (status == TW_OK && !packer->packing.zstd)
		status = tw_fail_memory(error);
	if (status == TW_OK)
		status = write_header(packer, info, error);
	if (status != TW_OK) {
		motion_packer_free(packer);
		return status;
	}
	*made = packer;
	return TW_OK;
}

void motion_packer_free(struct motion_packer *packer)
{
	if (!packer)
		return;
	ZSTD_freeCCtx(packer->packing.zstd);
	packing_clear(&packer->packing);
	free(packer);
}

enum tw_status motion_packer_add(struct motion_packer *packer, const float *positions, struct tw_error *error)
{
	struct packing *packing = &packer->packing;
	const size_t count = 3 * (size_t)packing->points;
	uint32_t *grid = packing_turn(packing);
	for (size_t i = 0; i < count; i++) {
		uint32_t place = (uint32_t)grid_place(positions[i]);
		uint32_t residual = place - predict(packing, grid, i);
		uint32_t folded = residual << 1 ^ (0 - (residual >> 31));
		grid[i] = place;
		for (size_t plane = 0; plane < 4; plane++)
			packing->planes[plane * count + i] = (unsigned char)(folded >> 8 * plane);
	}
	size_t size = ZSTD_compressCCtx(packing->zstd, packing->packed, packing->packed_limit, packing->planes,
					4 * count, LEVEL);
	if (ZSTD_isError(size))
		return tw_fail(error, TW_ERROR_INTERNAL, "motion-pack", NULL, "a frame could not be packed: %s",
			       ZSTD_getErrorName(size));
	unsigned char prefix[4];
	store_le32(prefix, (uint32_t)size);
	enum tw_status status = packer->write(packer->context, prefix, sizeof prefix, error);
	return status == TW_OK ? packer->write(packer->context, packing->packed, size, error) : status;
}

static enum tw_status pack_frames(struct motion_packer *packer, struct motion_reader *reader, float *positions,
				  uint32_t *frames, struct tw_error *error)
{
	bool end = false;
	for (*frames = 0;; ++*frames) {
		enum tw_status status = motion_next(reader, positions, &end, error);
		if (status == TW_OK && !end)
			status = motion_packer_add(packer, positions, error);
		if (status != TW_OK || end)
			return status;
	}
}

enum tw_status motion_pack(struct motion_reader *reader, motion_pack_write *write, void *context, uint32_t *frames,
			   struct tw_error *error)
{
	const struct motion_info *info = motion_info(reader);
	struct motion_packer *packer = NULL;
	float *positions = malloc(12 * (size_t)info->vertex_count);
	enum tw_status status =
		positions ? motion_packer_new(&packer, info, write, context, error) : tw_fail_memory(error);
	if (status == TW_OK)
		status = pack_frames(packer, reader, positions, frames, error);
	motion_packer_free(packer);
	free(positions);
	return status;
}

/* --- reading ----------------------------------------------------------------------------------- */

static void close_packing(void *state)
{
	struct packing *packing = state;
	if (!packing)
		return;
	ZSTD_freeDCtx(packing->zstd);
	packing_clear(packing);
	free(packing);
}

static enum tw_status read_header(struct motion_reader *reader, struct tw_error *error)
{
	unsigned char header[HEADER_BYTES];
	size_t got = 0;
	enum tw_status status = reader_read(reader, header, sizeof header, &got, error);
	if (status != TW_OK)
		return status;
	if (got < sizeof header || memcmp(header, magic, sizeof magic) != 0)
		return tw_fail(error, TW_ERROR_INPUT, "motion-bad-header", "byte 0",
			       "a packed motion has a header of 24 bytes that begins with TWFRAME1");
	float rate = float_of(load_le32(header + 16));
	if (!(rate > 0) || !isfinite(rate) || load_le32(header + 20) != 0)
		return tw_fail(error, TW_ERROR_INPUT, "motion-bad-header", "byte 16",
			       "the frame rate must be positive, and what follows it zero");
	reader->info.vertex_count = load_le32(header + 8);
	reader->info.frame_count = load_le32(header + 12);
	reader->info.frames_per_second = (double)rate;
	return reader_check_counts(reader, reader->info.vertex_count,
				   reader->info.frame_count ? reader->info.frame_count : 1, error);
}

static enum tw_status start(struct motion_reader *reader, struct tw_error *error)
{
	enum tw_status status = read_header(reader, error);
	if (status != TW_OK)
		return status;
	reader->scale = 1;
	struct packing *packing = reader->state;
	if (packing) {
		packing->frame = 0;
		return TW_OK;
	}
	packing = reader->state = calloc(1, sizeof *packing);
	if (!packing)
		return tw_fail_memory(error);
	status = packing_init(packing, reader->info.vertex_count, error);
	packing->zstd = ZSTD_createDCtx();
	return status == TW_OK && !packing->zstd ? tw_fail_memory(error) : status;
}

static enum tw_status damaged(const struct motion_reader *reader, struct tw_error *error)
{
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	return tw_fail(error, TW_ERROR_INPUT, "motion-damaged", where,
		       "frame %u of the packed motion is damaged; pack it again", reader->frame);
}

/* The next frame's residuals into the planes. */
static enum tw_status unpack(struct motion_reader *reader, bool *end, struct tw_error *error)
{
	struct packing *packing = reader->state;
	const size_t bytes = 12 * (size_t)packing->points;
	unsigned char prefix[4];
	size_t got = 0;
	enum tw_status status = reader_read(reader, prefix, sizeof prefix, &got, error);
	if (status != TW_OK)
		return status;
	*end = got == 0 && reader->info.frame_count == 0;
	if (*end)
		return TW_OK;
	uint32_t size = load_le32(prefix);
	if (got < sizeof prefix)
		return reader_truncated(reader, error);
	if (size == 0 || size > packing->packed_limit)
		return damaged(reader, error);
	status = reader_fill(reader, packing->packed, size, error);
	if (status == TW_OK &&
	    ZSTD_decompressDCtx(packing->zstd, packing->planes, bytes, packing->packed, size) != bytes)
		status = damaged(reader, error);
	return status;
}

static enum tw_status next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	struct packing *packing = reader->state;
	const size_t count = 3 * (size_t)packing->points;
	*end = reader->info.frame_count > 0 && reader->frame == reader->info.frame_count;
	enum tw_status status = *end ? reader_expect_end(reader, error) : unpack(reader, end, error);
	if (status != TW_OK || *end) {
		if (*end)
			reader->info.frame_count = reader->frame;
		return status;
	}
	if (reader->frame >= TW_LIMIT_FRAMES)
		return tw_fail(error, TW_ERROR_LIMIT, "motion-too-large", NULL, "the motion has more than %u frames",
			       TW_LIMIT_FRAMES);
	uint32_t *grid = packing_turn(packing);
	for (size_t i = 0; i < count; i++) {
		uint32_t folded = 0;
		for (size_t plane = 0; plane < 4; plane++)
			folded |= (uint32_t)packing->planes[plane * count + i] << 8 * plane;
		uint32_t residual = folded >> 1 ^ (0 - (folded & 1));
		grid[i] = predict(packing, grid, i) + residual;
		positions[i] = grid_position((int32_t)grid[i]);
	}
	return TW_OK;
}

const struct motion_codec packed_codec = {.start = start, .next = next, .close = close_packing};
