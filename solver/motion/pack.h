/* Motions packed to about a quarter of their size, for uploads and for keeping.
 *
 * A packed motion holds positions on a grid of 1/64 mm, so that none is further than MOTION_PACK_ERROR_MM along an axis
 * from what was packed. motion_open reads it like any other format, always in millimetres; packing what was unpacked
 * gives the same bytes.
 *
 * Format, little-endian: 8 bytes "TWFRAME1", u32 points, u32 frames (0: until the end), f32 frames per second, u32
 * zero; then for each frame a u32 size and that many bytes of a zstd frame (RFC 8878). Unpacked it holds 12 bytes a
 * point: plane 0 with the lowest byte of every coordinate x0 y0 z0 x1 …, then planes 1, 2 and 3. A coordinate's 32 bits
 * are its residual r as (r << 1) ^ (r >> 31), where r is its place on the grid less the predicted one: in the first
 * frame that of the point before it, in the second that of the frame before, then 2 a - b of the two frames before. */
#ifndef SOLVER_MOTION_PACK_H
#define SOLVER_MOTION_PACK_H

#include "solver/motion/motion.h"

#define MOTION_PACK_ERROR_MM (1.0 / 128)

/* Takes the packed bytes as they come. */
typedef enum tw_status motion_pack_write(void *context, const void *bytes, size_t size, struct tw_error *error);

struct motion_packer;

/* Writes the header. `info` gives points, frames (0 where unknown) and the rate. The packer is the caller's:
 * motion_packer_free, also after an error. TW_ERROR_MEMORY, and what `write` returns. */
enum tw_status motion_packer_new(struct motion_packer **packer, const struct motion_info *info,
				 motion_pack_write *write, void *context, struct tw_error *error) TW_NODISCARD;

/* Packs one frame, [3 * points] in millimetres, finite and within a kilometre of the origin, as motion_next gives them.
 */
enum tw_status motion_packer_add(struct motion_packer *packer, const float *positions,
				 struct tw_error *error) TW_NODISCARD;

void motion_packer_free(struct motion_packer *packer); /* NULL is allowed */

/* Packs all that is left of `reader`; *frames: how many there were. */
enum tw_status motion_pack(struct motion_reader *reader, motion_pack_write *write, void *context, uint32_t *frames,
			   struct tw_error *error) TW_NODISCARD;

#endif
