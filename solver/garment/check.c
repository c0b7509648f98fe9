/* Faces in the pattern: none without area, none flipped. */
#include "solver/garment/correspondence.h"
#include "solver/garment/draft.h"

#include <math.h>
#include <string.h>

/* A face thinner than this share of its longest side has no rest shape that a strain could be measured against. */
static const double thinnest = 1e-9;

static double longest_square(const struct garment *garment, uint32_t face)
{
	double longest = 0;
	for (size_t k = 0; k < 3; k++) {
		const double *a = garment->pattern + 2 * (size_t)garment->face_coord[3 * (size_t)face + k];
		const double *b = garment->pattern + 2 * (size_t)garment->face_coord[3 * (size_t)face + (k + 1) % 3];
		longest = fmax(longest, (b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
	}
	return longest;
}

/* Whether a face has the same place for all its corners, or three on one line, in the worn mesh. */
static bool has_worn_area(const struct garment *garment, uint32_t face)
{
	const uint32_t *v = garment->face_vertex + 3 * (size_t)face;
	double u[3], w[3];
	for (size_t axis = 0; axis < 3; axis++) {
		double origin = garment->position[3 * (size_t)v[0] + axis];
		u[axis] = garment->position[3 * (size_t)v[1] + axis] - origin;
		w[axis] = garment->position[3 * (size_t)v[2] + axis] - origin;
	}
	double x = u[1] * w[2] - u[2] * w[1], y = u[2] * w[0] - u[0] * w[2], z = u[0] * w[1] - u[1] * w[0];
	return x != 0 || y != 0 || z != 0;
}

static enum tw_status check_areas(struct draft *draft)
{
	const struct garment *garment = &draft->garment;
	struct garment_report *report = draft->report;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		double cross = draft_face_cross(draft, f);
		if (!(fabs(cross) > thinnest * longest_square(garment, f)))
			return fail_at_face(draft, f, "pattern-zero-area",
					    "face %u has no area in the flat pattern; its pattern positions are %u, %u "
					    "and %u",
					    garment_file_face(garment, f), garment->face_coord[3 * (size_t)f],
					    garment->face_coord[3 * (size_t)f + 1],
					    garment->face_coord[3 * (size_t)f + 2]);
		if (!has_worn_area(garment, f))
			warning_add(&report->warnings, "worn-zero-area", "face", garment_file_face(garment, f),
				    "faces without area in the worn mesh count as fully compressed there");
	}
	return TW_OK;
}

/* Mirrors the pieces that are marked left to right, each within its own bounding box. A pattern position belongs to one
 * piece. */
static enum tw_status turn_pieces(struct draft *draft, const uint8_t *marked)
{
	struct garment *garment = &draft->garment;
	const size_t corners = 3 * (size_t)garment->face_count;
	double *low = ARENA_ARRAY(draft->arena, garment->piece_count, double);
	double *high = ARENA_ARRAY(draft->arena, garment->piece_count, double);
	uint8_t *turned = ARENA_ZEROED(draft->arena, garment->coord_count, uint8_t);
	if (!low || !high || !turned)
		return tw_fail_memory(draft->error);
	for (uint32_t piece = 0; piece < garment->piece_count; piece++) {
		low[piece] = INFINITY;
		high[piece] = -INFINITY;
	}
	for (size_t i = 0; i < corners; i++) {
		uint32_t piece = garment->face_piece[i / 3];
		double u = garment->pattern[2 * (size_t)garment->face_coord[i]];
		low[piece] = fmin(low[piece], u);
		high[piece] = fmax(high[piece], u);
	}
	for (size_t i = 0; i < corners; i++) {
		uint32_t piece = garment->face_piece[i / 3], coord = garment->face_coord[i];
		if (!marked[piece] || turned[coord])
			continue;
		turned[coord] = 1;
		garment->pattern[2 * (size_t)coord] = low[piece] + high[piece] - garment->pattern[2 * (size_t)coord];
	}
	return TW_OK;
}

static bool is_clockwise(const struct draft *draft, uint32_t face)
{
	return draft_face_cross(draft, face) < 0;
}

/* Edges of the piece at which the pattern is folded: one face lies counter-clockwise, the other not. The first of them
 * goes to *fold. */
static uint32_t count_folds(const struct draft *draft, uint32_t piece, uint32_t *fold)
{
	const struct topology *topology = &draft->topology;
	uint32_t folds = 0;
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		const uint32_t *face = topology->edge_face + 2 * (size_t)e;
		if (topology->edge_kind[e] != EDGE_INNER || draft->garment.face_piece[face[0]] != piece ||
		    is_clockwise(draft, face[0]) == is_clockwise(draft, face[1]))
			continue;
		*fold = folds++ == 0 ? e : *fold;
	}
	return folds;
}

static const struct text *label_at(const struct draft *draft, uint32_t face)
{
	for (int kind = 0; kind < LABEL_KINDS; kind++) {
		const uint32_t *labels = draft->labels->polygon_label[kind];
		uint32_t label = labels ? labels[draft->garment.file_face[face]] : GARMENT_NONE;
		if (label != GARMENT_NONE)
			return &draft->labels->label[kind][label];
	}
	return NULL;
}

/* Two pieces that lie mirrored on each other, seam on seam, share the positions there and look like one. The fold
 * between them is short, where flipped faces are scattered. */
static bool is_folded(const struct draft *draft, uint32_t piece, uint32_t clockwise, uint32_t faces, uint32_t *fold)
{
	uint32_t lesser = clockwise < faces - clockwise ? clockwise : faces - clockwise;
	uint32_t folds = count_folds(draft, piece, fold);
	return lesser >= 4 && folds > 0 && 2 * (uint64_t)folds <= lesser;
}

static enum tw_status folded_piece(const struct draft *draft, uint32_t fold)
{
	const uint32_t *face = draft->topology.edge_face + 2 * (size_t)fold;
	const uint32_t mirrored = is_clockwise(draft, face[0]) ? face[0] : face[1];
	const struct text *here = label_at(draft, face[0]), *there = label_at(draft, face[1]);
	if (here && there && here != there)
		return fail_at_face(
			draft, mirrored, "pieces-on-each-other",
			"%.*s and %.*s lie mirrored on each other in the flat pattern, seam on seam: move one of "
			"them",
			text_cut(here, 60), here->at, text_cut(there, 60), there->at);
	return fail_at_face(
		draft, mirrored, "pieces-on-each-other",
		"two pieces lie mirrored on each other in the flat pattern, the one with face %u on the one "
		"with face %u: move one of them",
		garment_file_face(&draft->garment, face[0]), garment_file_face(&draft->garment, face[1]));
}

/* The first faces of the piece that are clockwise (or, where most are, that are not). */
static enum tw_status flipped(const struct draft *draft, uint32_t piece, uint32_t clockwise, uint32_t faces)
{
	const struct garment *garment = &draft->garment;
	bool minority = 2 * (uint64_t)clockwise <= faces;
	char list[96] = "";
	uint32_t first = GARMENT_NONE, listed = 0;
	for (uint32_t f = 0; f < garment->face_count && listed < 6; f++) {
		if (garment->face_piece[f] != piece || (draft_face_cross(draft, f) < 0) != minority)
			continue;
		if (listed++ == 0)
			first = f;
		size_t size = strlen(list);
		snprintf(list + size, sizeof list - size, "%s%u", size ? ", " : "", garment_file_face(garment, f));
	}
	uint32_t count = minority ? clockwise : faces - clockwise;
	const char *name = garment->piece_name[piece];
	return fail_at_face(draft, first, "pattern-flipped-face",
			    "in piece %u (%.*s), %u of %u faces are flipped in the flat pattern: %s%s", piece,
			    utf8_cut(name, 60), name, count, faces, list, count > listed ? ", …" : "");
}

static enum tw_status mirrored_piece(const struct draft *draft, uint32_t piece)
{
	const char *name = draft->garment.piece_name[piece];
	uint32_t face = 0;
	while (draft->garment.face_piece[face] != piece)
		face++;
	return fail_at_face(
		draft, face, "pattern-mirrored-piece",
		"all faces of piece %u (%.*s) are clockwise in the flat pattern: it lies wrong side up; mirror it, "
		"or import with mirrored_pieces = turn",
		piece, utf8_cut(name, 60), name);
}

enum tw_status draft_check_faces(struct draft *draft, enum mirrored_pieces mirrored)
{
	enum tw_status status = check_areas(draft);
	if (status != TW_OK)
		return status;
	const struct garment *garment = &draft->garment;
	uint32_t *faces = ARENA_ZEROED(draft->arena, garment->piece_count, uint32_t);
	uint32_t *clockwise = ARENA_ZEROED(draft->arena, garment->piece_count, uint32_t);
	uint8_t *mirror = ARENA_ZEROED(draft->arena, garment->piece_count, uint8_t);
	if (!faces || !clockwise || !mirror)
		return tw_fail_memory(draft->error);
	for (uint32_t f = 0; f < garment->face_count; f++) {
		faces[garment->face_piece[f]]++;
		clockwise[garment->face_piece[f]] += draft_face_cross(draft, f) < 0;
	}
	for (uint32_t piece = 0; piece < garment->piece_count; piece++) {
		if (clockwise[piece] == 0)
			continue;
		uint32_t fold = 0;
		if (clockwise[piece] < faces[piece])
			return is_folded(draft, piece, clockwise[piece], faces[piece], &fold)
				       ? folded_piece(draft, fold)
				       : flipped(draft, piece, clockwise[piece], faces[piece]);
		if (mirrored == MIRRORED_REFUSE)
			return mirrored_piece(draft, piece);
		mirror[piece] = 1;
		warning_add(&draft->report->warnings, "pieces-turned", "piece", piece,
			    "pieces that lay wrong side up in the pattern were mirrored left to right");
	}
	return turn_pieces(draft, mirror);
}
