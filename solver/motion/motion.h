/* Motions of a garment: point caches, read frame by frame from a stream, so that one frame is in memory at a time.
 *
 * PC2: 12 bytes "POINTCACHE2\0", i32 version 1, i32 points, f32 start frame, f32 frames per sample, i32 samples; then
 * f32 x y z per point and sample; little-endian.
 * MDD: i32 frames, i32 points, f32 seconds of each frame; then f32 x y z per point and frame; big-endian.
 * Packed: see pack.h.
 * OBJ sequence: a tar (ustar, GNU or pax) of OBJ files, one per frame, read in the order of their names (digits
 * compared as numbers) wherever they stand in it; the faces of every frame must be those of the first. */
#ifndef SOLVER_MOTION_MOTION_H
#define SOLVER_MOTION_MOTION_H

#include "solver/garment/options.h"
#include "solver/motion/info.h"
#include "solver/motion/source.h"

#include <stdbool.h>

struct motion_reader;

/* Reads the header. `vertex_count`: what the garment expects (garment_source_count); 0 accepts any. `unit` is that of
 * the positions. MOTION_SNIFF decides by the first bytes. The reader is the caller's: motion_close, also after an error
 * of motion_next. `source` is copied; its context is borrowed. Errors: TW_ERROR_INPUT (truncated, other vertex count,
 * version, sizes that disagree), TW_ERROR_LIMIT, TW_ERROR_MEMORY, and what the source returns. */
enum tw_status motion_open(struct motion_reader **reader, const struct byte_source *source, enum motion_format format,
			   enum length_unit unit, uint32_t vertex_count, struct tw_error *error) TW_NODISCARD;
void motion_close(struct motion_reader *reader); /* NULL is allowed */

const struct motion_info *motion_info(const struct motion_reader *reader);

/* The next frame in millimetres, [3 * vertex_count], or *end = true and `positions` untouched. Errors as above, with
 * frame and vertex ("frame 3 vertex 17"): not a number, infinite, truncated, bytes after the last frame. */
enum tw_status motion_next(struct motion_reader *reader, float *positions, bool *end,
			   struct tw_error *error) TW_NODISCARD;

/* From the next frame on, positions are what packing them would keep of them (solver/motion/pack.h). */
void motion_round(struct motion_reader *reader);

/* To the first frame again. */
enum tw_status motion_rewind(struct motion_reader *reader, struct tw_error *error) TW_NODISCARD;

/* Writes a PC2 header; frames follow as f32 little-endian x y z. Returns the bytes written (PC2_HEADER_BYTES). */
enum { PC2_HEADER_BYTES = 32 };
size_t pc2_write_header(void *bytes, uint32_t vertex_count, uint32_t frame_count);

#endif
