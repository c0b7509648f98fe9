/* One walk over the faces gives their order; all else follows from it. */
#include "solver/garment/canonical.h"

#include "solver/garment/first_corner.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* What tells one face from another: its corners on the pattern, then as worn, from the first on. */
enum { FACE_NUMBERS = 15 };
struct face_key {
	double number[FACE_NUMBERS];
	uint32_t face;
};

static struct face_key key_of(const struct garment *garment, uint32_t face)
{
	struct face_key key = {.face = face};
	const uint32_t first = face_first_corner(garment, face);
	for (uint32_t k = 0; k < 3; k++) {
		size_t corner = 3 * (size_t)face + (first + k) % 3;
		const double *u = garment->pattern + 2 * (size_t)garment->face_coord[corner];
		const double *x = garment->position + 3 * (size_t)garment->face_vertex[corner];
		memcpy(key.number + 2 * (size_t)k, u, 2 * sizeof *u);
		memcpy(key.number + 6 + 3 * (size_t)k, x, 3 * sizeof *x);
	}
	return key;
}

/* Of two that are alike in all numbers, one above the other, the file's order decides. */
static int compare_keys(const void *a, const void *b)
{
	const struct face_key *p = a, *q = b;
	for (size_t i = 0; i < FACE_NUMBERS; i++)
		if (p->number[i] != q->number[i])
			return p->number[i] < q->number[i] ? -1 : 1;
	return p->face < q->face ? -1 : p->face > q->face;
}

static uint32_t across(const struct topology *topology, uint32_t face, uint32_t side)
{
	const uint32_t *pair = topology->edge_face + 2 * (size_t)topology->face_edge[3 * (size_t)face + side];
	return pair[0] == face ? pair[1] : pair[0];
}

/* Breadth first from `start`: face[placed…) and their places. Returns how many are placed then. */
static uint32_t walk(struct canonical *canonical, const struct topology *topology, uint32_t start, uint32_t placed)
{
	uint32_t head = placed;
	canonical->face[placed] = start;
	canonical->face_of[start] = placed++;
	for (; head < placed; head++) {
		uint32_t face = canonical->face[head];
		canonical->turn[head] = (uint8_t)face_first_corner(canonical->original, face);
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t next = across(topology, face, (canonical->turn[head] + k) % 3);
			if (next == GARMENT_NONE || canonical->face_of[next] != GARMENT_NONE)
				continue;
			canonical->face[placed] = next;
			canonical->face_of[next] = placed++;
		}
	}
	return placed;
}

/* The lowest of some faces. Most are told apart by their first number, and of those no key is made. */
static struct face_key lowest(const struct garment *garment, const uint32_t *face, uint32_t count)
{
	struct face_key best = key_of(garment, face[0]);
	for (uint32_t i = 1; i < count; i++) {
		uint32_t coord = garment->face_coord[3 * (size_t)face[i] + face_first_corner(garment, face[i])];
		if (garment->pattern[2 * (size_t)coord] > best.number[0])
			continue;
		struct face_key key = key_of(garment, face[i]);
		if (compare_keys(&key, &best) < 0)
			best = key;
	}
	return best;
}

/* Walks every part that sides hold together from any of its faces, to find its lowest; start[] takes as many as there
 * are parts. Leaves nothing placed. */
static uint32_t find_starts(struct canonical *canonical, const struct topology *topology, struct face_key *start)
{
	const uint32_t faces = canonical->original->face_count;
	uint32_t parts = 0, placed = 0;
	memset(canonical->face_of, 0xff, faces * sizeof *canonical->face_of);
	for (uint32_t f = 0; f < faces; f++) {
		if (canonical->face_of[f] != GARMENT_NONE)
			continue;
		uint32_t first = placed;
		placed = walk(canonical, topology, f, placed);
		if (start)
			start[parts] = lowest(canonical->original, canonical->face + first, placed - first);
		parts++;
	}
	memset(canonical->face_of, 0xff, faces * sizeof *canonical->face_of);
	return parts;
}

static enum tw_status order(struct canonical *canonical, struct arena *arena, const struct topology *topology,
			    struct tw_error *error)
{
	const struct arena_mark mark = arena_mark(arena);
	uint32_t parts = find_starts(canonical, topology, NULL), placed = 0;
	struct face_key *start = ARENA_ARRAY(arena, parts, struct face_key);
	if (!start)
		return tw_fail_memory(error);
	find_starts(canonical, topology, start);
	qsort(start, parts, sizeof *start, compare_keys);
	for (uint32_t i = 0; i < parts; i++)
		placed = walk(canonical, topology, start[i].face, placed);
	assert(placed == canonical->original->face_count);
	arena_release(arena, mark);
	return TW_OK;
}

/* Numbers what the corners name in the order in which they meet it. `name`: [face_count][3] of the original's, `to`
 * the same in the new numbers; `number`: [count], where each of the original's is; `back`: [count]. What no corner
 * names follows behind. */
static void number_corners(const struct canonical *canonical, const uint32_t *name, uint32_t *to, uint32_t count,
			   uint32_t *number, uint32_t *back)
{
	uint32_t met = 0;
	memset(number, 0xff, count * sizeof *number);
	for (uint32_t f = 0; f < canonical->original->face_count; f++) {
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t from = name[3 * (size_t)canonical->face[f] + (canonical->turn[f] + k) % 3];
			if (number[from] == GARMENT_NONE) {
				back[met] = from;
				number[from] = met++;
			}
			to[3 * (size_t)f + k] = number[from];
		}
	}
	for (uint32_t i = 0; i < count; i++) {
		if (number[i] != GARMENT_NONE)
			continue;
		back[met] = i;
		number[i] = met++;
	}
}

static void copy_rows(double *to, const double *from, const uint32_t *row, uint32_t count, size_t width)
{
	for (uint32_t i = 0; i < count; i++)
		memcpy(to + width * i, from + width * row[i], width * sizeof *to);
}

static enum tw_status copy_garment(struct canonical *canonical, struct arena *arena, struct tw_error *error)
{
	const struct garment *original = canonical->original;
	struct garment *garment = &canonical->garment;
	*garment = (struct garment){
		.vertex_count = original->vertex_count,
		.face_count = original->face_count,
		.coord_count = original->coord_count,
		.piece_count = original->piece_count,
		.position = ARENA_ARRAY(arena, 3 * (size_t)original->vertex_count, double),
		.pattern = ARENA_ARRAY(arena, 2 * (size_t)original->coord_count, double),
		.face_vertex = ARENA_ARRAY(arena, 3 * (size_t)original->face_count, uint32_t),
		.face_coord = ARENA_ARRAY(arena, 3 * (size_t)original->face_count, uint32_t),
		.face_piece = ARENA_ARRAY(arena, original->face_count, uint32_t),
		.piece_name = original->piece_name,
	};
	struct arena_mark mark = arena_mark(arena);
	uint32_t *coord_of = ARENA_ARRAY(arena, original->coord_count, uint32_t);
	uint32_t *coord = ARENA_ARRAY(arena, original->coord_count, uint32_t);
	if (!garment->position || !garment->pattern || !garment->face_vertex || !garment->face_coord ||
	    !garment->face_piece || !coord_of || !coord)
		return tw_fail_memory(error);
	number_corners(canonical, original->face_vertex, garment->face_vertex, original->vertex_count,
		       canonical->vertex_of, canonical->vertex);
	number_corners(canonical, original->face_coord, garment->face_coord, original->coord_count, coord_of, coord);
	copy_rows(garment->position, original->position, canonical->vertex, original->vertex_count, 3);
	copy_rows(garment->pattern, original->pattern, coord, original->coord_count, 2);
	for (uint32_t f = 0; f < original->face_count; f++)
		garment->face_piece[f] = original->face_piece[canonical->face[f]];
	arena_release(arena, mark);
	return TW_OK;
}

static void map_edges(struct canonical *canonical, const struct topology *topology)
{
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		uint32_t face = canonical->topology.edge_face[2 * (size_t)e];
		uint32_t side = (canonical->topology.edge_side[2 * (size_t)e] + canonical->turn[face]) % 3u;
		canonical->edge[e] = topology->face_edge[3 * (size_t)canonical->face[face] + side];
		canonical->edge_of[canonical->edge[e]] = e;
	}
}

enum tw_status canonical_build(struct canonical *canonical, struct arena *arena, const struct garment *original,
			       const struct topology *topology, struct tw_error *error)
{
	*canonical = (struct canonical){
		.original = original,
		.vertex = ARENA_ARRAY(arena, original->vertex_count, uint32_t),
		.face = ARENA_ARRAY(arena, original->face_count, uint32_t),
		.turn = ARENA_ARRAY(arena, original->face_count, uint8_t),
		.edge = ARENA_ARRAY(arena, topology->edge_count, uint32_t),
		.vertex_of = ARENA_ARRAY(arena, original->vertex_count, uint32_t),
		.face_of = ARENA_ARRAY(arena, original->face_count, uint32_t),
		.edge_of = ARENA_ARRAY(arena, topology->edge_count, uint32_t),
	};
	if (!canonical->vertex || !canonical->face || !canonical->turn || !canonical->edge || !canonical->vertex_of ||
	    !canonical->face_of || !canonical->edge_of)
		return tw_fail_memory(error);
	enum tw_status status = order(canonical, arena, topology, error);
	if (status == TW_OK)
		status = copy_garment(canonical, arena, error);
	if (status == TW_OK)
		status = topology_build(&canonical->topology, arena, &canonical->garment, error);
	if (status == TW_OK)
		map_edges(canonical, topology);
	return status;
}

void canonical_weights(const struct canonical *canonical, uint32_t face, const double original[3], double to[3])
{
	for (uint32_t k = 0; k < 3; k++)
		to[k] = original[(canonical->turn[face] + k) % 3];
}

void canonical_original_weights(const struct canonical *canonical, uint32_t face, const double from[3],
				double original[3])
{
	for (uint32_t k = 0; k < 3; k++)
		original[(canonical->turn[face] + k) % 3] = from[k];
}
