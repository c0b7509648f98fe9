/* A cache-friendly order of faces. */
#ifndef SOLVER_FIELD_ORDER_H
#define SOLVER_FIELD_ORDER_H

#include "solver/arena.h"
#include "tightwire.h"

/* order[i] is the face at place i; faces that share vertices stand close together. The order of the file is kept where
 * it does that already. `corner` [face_count][3], below vertex_count. Scratch is taken from the arena and given back.
 */
enum tw_status order_faces(uint32_t *order, struct arena *arena, const uint32_t *corner, uint32_t face_count,
			   uint32_t vertex_count, struct tw_error *error) TW_NODISCARD;

#endif
