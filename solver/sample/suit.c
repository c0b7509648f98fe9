/* Puts the halves together: size, mirror image, pieces on the sheet. All coordinates are rounded to 0.1 micrometre, so
 * that a garment in memory and one read back from its text are the same. */
#include "solver/sample/half.h"
#include "solver/sample/sample.h"
#include "solver/sample/size.h"

#include <stdio.h>
#include <string.h>

static const char *const half_piece_names[HALF_PIECES] = {
	"torso_front", "torso_back", "sleeve_front", "sleeve_back", "leg_front", "leg_back",
};

/* mm between the pieces' boxes on the sheet. */
static const double sheet_gap = 30;

/* Rows of the sheet from the bottom up: each part has one, with front and back, left and right. */
static const enum body_part sheet_rows[BODY_PARTS] = {BODY_SLEEVE, BODY_TORSO, BODY_LEG};

struct box {
	double width, height; /* of a piece */
	double left[2], low;  /* place of the left and the right piece on the sheet */
};

static double rounded(double mm)
{
	return floor(mm * 1e4 + 0.5) / 1e4;
}

struct vec3 size_scale(enum sample_size size)
{
	/* Height, and girth by the root of weight over height: 66, 75 and 86 kg. */
	static const struct vec3 scale[] = {{0.953, 0.971, 0.953}, {1, 1, 1}, {1.05, 1.04, 1.05}};
	return scale[size];
}

static void boxes_make(const struct half *half, struct box box[HALF_PIECES])
{
	memset(box, 0, HALF_PIECES * sizeof *box);
	for (uint32_t f = 0; f < half->surface.face_count; f++)
		for (int k = 0; k < 3; k++) {
			const double *p = half->flat[half->coord[f][k]];
			struct box *b = &box[half->surface.piece[f]];
			b->width = p[0] > b->width ? p[0] : b->width;
			b->height = p[1] > b->height ? p[1] : b->height;
		}
	double low = 0;
	for (int row = 0; row < BODY_PARTS; row++) {
		double left = 0, tallest = 0;
		for (int i = 0; i < 4; i++) {
			struct box *b = &box[2 * sheet_rows[row] + (unsigned)i / 2];
			/* The wearer's right front lies to the left, as one sees it; the back the other way round. */
			b->left[i == 1 || i == 2 ? 0 : 1] = left;
			b->low = low;
			left += b->width + sheet_gap;
			tallest = b->height > tallest ? b->height : tallest;
		}
		low += tallest + sheet_gap;
	}
}

static bool garment_room(struct garment *garment, struct arena *arena, const struct half *half)
{
	const uint32_t vertices = half_whole_count(half), faces = 2 * half->surface.face_count;
	*garment = (struct garment){
		.vertex_count = vertices,
		.face_count = faces,
		.coord_count = 2 * half->coord_count,
		.piece_count = 2 * HALF_PIECES,
		.position = ARENA_ARRAY(arena, 3 * (size_t)vertices, double),
		.pattern = ARENA_ARRAY(arena, 4 * (size_t)half->coord_count, double),
		.face_vertex = ARENA_ARRAY(arena, 3 * (size_t)faces, uint32_t),
		.face_coord = ARENA_ARRAY(arena, 3 * (size_t)faces, uint32_t),
		.face_piece = ARENA_ARRAY(arena, faces, uint32_t),
		.piece_name = ARENA_ARRAY(arena, 2 * HALF_PIECES, char *),
	};
	if (!garment->position || !garment->pattern || !garment->face_vertex || !garment->face_coord ||
	    !garment->face_piece || !garment->piece_name)
		return false;
	for (uint32_t i = 0; i < garment->piece_count; i++) {
		garment->piece_name[i] = ARENA_ARRAY(arena, 32, char);
		if (!garment->piece_name[i])
			return false;
		snprintf(garment->piece_name[i], 32, "%s_%s", half_piece_names[i / 2], i % 2 ? "right" : "left");
	}
	return true;
}

/* Left vertices keep their numbers; their mirror images follow. `mirror` gets the image of each. */
static void place_vertices(struct garment *garment, const struct half *half, struct vec3 scale, uint32_t *mirror)
{
	uint32_t count = half->surface.vertex_count, image = count;
	for (uint32_t v = 0; v < count; v++) {
		struct vec3 p = half->surface.position[v];
		double *at = garment->position + 3 * (size_t)v;
		at[0] = rounded(p.x * scale.x);
		at[1] = rounded(p.y * scale.y);
		at[2] = rounded(p.z * scale.z);
		mirror[v] = half->surface.cuts[v] >> CUT_CENTRE & 1 ? v : image++;
		double *other = garment->position + 3 * (size_t)mirror[v];
		other[0] = mirror[v] == v ? 0 : -at[0];
		other[1] = at[1];
		other[2] = at[2];
	}
}

static void place_pattern(struct garment *garment, const struct half *half, const struct box box[HALF_PIECES])
{
	for (uint32_t f = 0; f < half->surface.face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t c = half->coord[f][k];
			const struct box *b = &box[half->surface.piece[f]];
			const double *p = half->flat[c];
			double *left = garment->pattern + 2 * (size_t)c;
			double *right = garment->pattern + 2 * ((size_t)c + half->coord_count);
			left[0] = rounded(b->left[0] + p[0]);
			right[0] = rounded(b->left[1] + b->width - p[0]);
			left[1] = right[1] = rounded(b->low + p[1]);
		}
}

/* Piece by piece, left before right; the image's corners run the other way round. */
static void place_faces(struct garment *garment, const struct half *half, const uint32_t *mirror)
{
	uint32_t out = 0;
	for (uint32_t first = 0, last; first < half->surface.face_count; first = last) {
		uint8_t piece = half->surface.piece[first];
		for (last = first; last < half->surface.face_count && half->surface.piece[last] == piece;)
			last++;
		for (unsigned right = 0; right < 2; right++)
			for (uint32_t f = first; f < last; f++, out++) {
				garment->face_piece[out] = 2u * piece + right;
				for (unsigned k = 0; k < 3; k++) {
					unsigned from = right && k ? 3 - k : k;
					uint32_t v = half->surface.corner[f][from], c = half->coord[f][from];
					garment->face_vertex[3 * (size_t)out + k] = right ? mirror[v] : v;
					garment->face_coord[3 * (size_t)out + k] = right ? c + half->coord_count : c;
				}
			}
	}
}

static bool make_suit(struct garment *garment, struct arena *arena, struct arena *scratch, uint32_t vertices,
		      struct vec3 scale)
{
	struct body body;
	struct half half = {0};
	struct box box[HALF_PIECES];
	int levels = vertices <= 30000 ? 0 : vertices <= 200000 ? 1 : 2;
	body_init(&body);
	if (!half_mesh(&half, scratch, &body, vertices, levels) || !half_flatten(&half, scratch, &body, scale))
		return false;
	for (int level = 0; level < levels; level++) {
		struct half fine = {0};
		if (!half_refine(&fine, scratch, &body, &half))
			return false;
		half = fine;
	}
	uint32_t *mirror = ARENA_ARRAY(scratch, half.surface.vertex_count, uint32_t);
	if (!mirror || !garment_room(garment, arena, &half))
		return false;
	boxes_make(&half, box);
	place_vertices(garment, &half, scale, mirror);
	place_pattern(garment, &half, box);
	place_faces(garment, &half, mirror);
	return true;
}

enum tw_status sample_garment(struct garment *garment, struct arena *arena, uint32_t vertices, enum sample_size size,
			      struct tw_error *error)
{
	if (vertices < SAMPLE_VERTICES_MIN || vertices > SAMPLE_VERTICES_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "sample-vertices", NULL,
			       "a sample suit has %u to %u vertices, not %u", SAMPLE_VERTICES_MIN, SAMPLE_VERTICES_MAX,
			       vertices);
	struct arena *scratch = arena_new(0);
	bool made = scratch && make_suit(garment, arena, scratch, vertices, size_scale(size));
	arena_free(scratch);
	return made ? TW_OK : tw_fail_memory(error);
}
