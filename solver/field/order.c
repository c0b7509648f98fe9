/* Faces in the order of a breadth-first walk over vertices, as Cuthill and McKee number a matrix (ACM 1969): every face
 * goes to the place of the first vertex of its own that the walk reaches. Linear in faces. */
#include "solver/field/order.h"

#include <stdbool.h>
#include <string.h>

/* The file's order is good when windows of it reuse their vertices: a window of n faces of a manifold has some n / 2
 * vertices; at random it has 3 n. */
enum { WINDOW = 1024 };

static bool is_coherent(const uint32_t *corner, uint32_t face_count, uint32_t *seen, uint32_t vertex_count)
{
	memset(seen, 0xff, vertex_count * sizeof *seen);
	uint64_t loads = 0;
	for (uint32_t f = 0; f < face_count; f++) {
		for (size_t k = 0; k < 3; k++) {
			uint32_t v = corner[3 * (size_t)f + k];
			loads += seen[v] != f / WINDOW;
			seen[v] = f / WINDOW;
		}
	}
	return loads * 4 <= (uint64_t)face_count * 3;
}

/* Faces of each vertex in compressed rows: first[vertex_count + 1], row[3 * face_count]. */
static void build_rows(uint32_t *first, uint32_t *row, const uint32_t *corner, uint32_t face_count,
		       uint32_t vertex_count)
{
	memset(first, 0, ((size_t)vertex_count + 1) * sizeof *first);
	for (size_t c = 0; c < 3 * (size_t)face_count; c++)
		first[corner[c]]++;
	uint32_t sum = 0;
	for (uint32_t v = 0; v <= vertex_count; v++) {
		sum += v < vertex_count ? first[v] : 0;
		first[v] = sum;
	}
	for (size_t c = 3 * (size_t)face_count; c-- > 0;)
		row[--first[corner[c]]] = (uint32_t)(c / 3);
}

static void walk(uint32_t *order, uint8_t *face_done, uint8_t *vertex_done, uint32_t *queue, const uint32_t *first,
		 const uint32_t *row, const uint32_t *corner, uint32_t vertex_count)
{
	uint32_t placed = 0;
	for (uint32_t start = 0; start < vertex_count; start++) {
		if (vertex_done[start])
			continue;
		uint32_t head = 0, tail = 0;
		queue[tail++] = start;
		vertex_done[start] = 1;
		while (head < tail) {
			uint32_t v = queue[head++];
			for (uint32_t a = first[v]; a < first[v + 1]; a++) {
				uint32_t f = row[a];
				if (face_done[f])
					continue;
				face_done[f] = 1;
				order[placed++] = f;
				for (size_t k = 0; k < 3; k++) {
					uint32_t w = corner[3 * (size_t)f + k];
					if (!vertex_done[w]) {
						vertex_done[w] = 1;
						queue[tail++] = w;
					}
				}
			}
		}
	}
}

enum tw_status order_faces(uint32_t *order, struct arena *arena, const uint32_t *corner, uint32_t face_count,
			   uint32_t vertex_count, struct tw_error *error)
{
	struct arena_mark mark = arena_mark(arena);
	enum tw_status status = TW_OK;
	uint32_t *queue = ARENA_ARRAY(arena, vertex_count, uint32_t);
	uint32_t *first = ARENA_ARRAY(arena, (size_t)vertex_count + 1, uint32_t);
	uint32_t *row = ARENA_ARRAY(arena, 3 * (size_t)face_count, uint32_t);
	uint8_t *face_done = ARENA_ZEROED(arena, face_count, uint8_t);
	uint8_t *vertex_done = ARENA_ZEROED(arena, vertex_count, uint8_t);
	if (!queue || !first || !row || !face_done || !vertex_done) {
		status = tw_fail_memory(error);
	} else if (is_coherent(corner, face_count, queue, vertex_count)) {
		for (uint32_t f = 0; f < face_count; f++)
			order[f] = f;
	} else {
		build_rows(first, row, corner, face_count, vertex_count);
		walk(order, face_done, vertex_done, queue, first, row, corner, vertex_count);
	}
	arena_release(arena, mark);
	return status;
}
