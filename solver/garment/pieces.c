/* Pieces: faces joined by inner edges. A name is the first label that all faces of the piece have and that no other
 * piece bears; else the first that they all have, numbered apart; else the piece's number. */
#include "solver/garment/draft.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE_LIMIT = 4096, NAME_BYTES = 200 };

static uint32_t find_root(uint32_t *parent, uint32_t face)
{
	while (parent[face] != face) {
		parent[face] = parent[parent[face]];
		face = parent[face];
	}
	return face;
}

static enum tw_status number_pieces(struct draft *draft)
{
	struct garment *garment = &draft->garment;
	const struct topology *topology = &draft->topology;
	uint32_t *piece = garment->face_piece = ARENA_ARRAY(draft->arena, garment->face_count, uint32_t);
	if (!piece)
		return tw_fail_memory(draft->error);
	for (uint32_t f = 0; f < garment->face_count; f++)
		piece[f] = f;
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		if (topology->edge_kind[e] != EDGE_INNER)
			continue;
		uint32_t a = find_root(piece, topology->edge_face[2 * (size_t)e]);
		uint32_t b = find_root(piece, topology->edge_face[2 * (size_t)e + 1]);
		piece[a < b ? b : a] = a < b ? a : b;
	}
	for (uint32_t f = 0; f < garment->face_count; f++)
		piece[f] = find_root(piece, f);
	garment->piece_count = 0;
	for (uint32_t f = 0; f < garment->face_count; f++)
		piece[f] = piece[f] == f ? garment->piece_count++ : piece[piece[f]];
	if (garment->piece_count > PIECE_LIMIT)
		return tw_fail(
			draft->error, TW_ERROR_LIMIT, "too-many-pieces", NULL,
			"the pattern falls into %u pieces, more than %d; neighbouring faces must share their pattern "
			"positions, and their vertices (weld_mm sews those that are written twice)",
			garment->piece_count, PIECE_LIMIT);
	return TW_OK;
}

/* Two pieces that touch at a point may share its position; each gets its own, so that a piece can be moved. */
static enum tw_status part_coords(struct draft *draft)
{
	struct garment *garment = &draft->garment;
	size_t limit = (size_t)garment->coord_count + 3 * (size_t)garment->face_count;
	uint32_t *owner = ARENA_ARRAY(draft->arena, limit, uint32_t);
	uint32_t *copy = ARENA_ARRAY(draft->arena, limit, uint32_t);
	double *pattern = ARENA_ARRAY(draft->arena, 2 * limit, double);
	if (!owner || !copy || !pattern)
		return tw_fail_memory(draft->error);
	memset(owner, 0xff, limit * sizeof *owner);
	memset(copy, 0xff, limit * sizeof *copy);
	memcpy(pattern, garment->pattern, 2 * (size_t)garment->coord_count * sizeof *pattern);
	garment->pattern = pattern;
	for (size_t i = 0; i < 3 * (size_t)garment->face_count; i++) {
		uint32_t piece = garment->face_piece[i / 3], coord = garment->face_coord[i];
		while (owner[coord] != piece && owner[coord] != GARMENT_NONE) {
			if (copy[coord] == GARMENT_NONE) {
				copy[coord] = garment->coord_count++;
				memcpy(pattern + 2 * (size_t)copy[coord], pattern + 2 * (size_t)coord,
				       2 * sizeof *pattern);
			}
			coord = copy[coord];
		}
		owner[coord] = piece;
		garment->face_coord[i] = coord;
	}
	return TW_OK;
}

/* labels[piece]: the label that all faces of the piece have, or GARMENT_NONE. */
static void agree_labels(const struct draft *draft, enum label_kind kind, uint32_t *labels)
{
	const uint32_t *polygon_label = draft->labels->polygon_label[kind];
	const struct garment *garment = &draft->garment;
	uint8_t seen[PIECE_LIMIT] = {0};
	for (uint32_t f = 0; f < garment->face_count; f++) {
		uint32_t piece = garment->face_piece[f];
		uint32_t label = polygon_label ? polygon_label[garment->file_face[f]] : GARMENT_NONE;
		if (!seen[piece])
			labels[piece] = label;
		else if (labels[piece] != label)
			labels[piece] = GARMENT_NONE;
		seen[piece] = 1;
	}
}

static bool is_alone(const uint32_t *labels, uint32_t count, uint32_t piece)
{
	for (uint32_t other = 0; other < count; other++) {
		if (other != piece && labels[other] == labels[piece])
			return false;
	}
	return true;
}

/* The kind of label that names the piece; LABEL_KINDS where none does. */
static int choose_label(uint32_t labels[LABEL_KINDS][PIECE_LIMIT], uint32_t count, uint32_t piece)
{
	int first = LABEL_KINDS;
	for (int kind = 0; kind < LABEL_KINDS; kind++) {
		if (labels[kind][piece] == GARMENT_NONE)
			continue;
		if (is_alone(labels[kind], count, piece))
			return kind;
		if (first == LABEL_KINDS)
			first = kind;
	}
	return first;
}

static bool is_taken(char **names, uint32_t count, const char *name)
{
	for (uint32_t i = 0; i < count; i++) {
		if (strcmp(names[i], name) == 0)
			return true;
	}
	return false;
}

static enum tw_status write_name(struct draft *draft, uint32_t piece, const struct text *label)
{
	struct garment *garment = &draft->garment;
	char name[NAME_BYTES + 16];
	int size = label ? (int)(label->end - label->at) : 0;
	if (size > 0 && size <= NAME_BYTES)
		snprintf(name, sizeof name, "%.*s", size, label->at);
	else
		size = snprintf(name, sizeof name, "piece-%u", piece + 1);
	for (uint32_t number = 2; is_taken(garment->piece_name, piece, name); number++)
		snprintf(name + size, sizeof name - (size_t)size, "-%u", number);
	char *copy = ARENA_ARRAY(draft->arena, strlen(name) + 1, char);
	if (!copy)
		return tw_fail_memory(draft->error);
	garment->piece_name[piece] = memcpy(copy, name, strlen(name) + 1);
	return TW_OK;
}

static enum tw_status name_pieces(struct draft *draft)
{
	struct garment *garment = &draft->garment;
	garment->piece_name = ARENA_ARRAY(draft->arena, garment->piece_count, char *);
	if (!garment->piece_name)
		return tw_fail_memory(draft->error);
	uint32_t(*labels)[PIECE_LIMIT] = arena_array(draft->arena, LABEL_KINDS, sizeof *labels);
	if (!labels)
		return tw_fail_memory(draft->error);
	for (int kind = 0; kind < LABEL_KINDS; kind++)
		agree_labels(draft, (enum label_kind)kind, labels[kind]);
	for (uint32_t piece = 0; piece < garment->piece_count; piece++) {
		int kind = choose_label(labels, garment->piece_count, piece);
		const struct text *label =
			kind == LABEL_KINDS ? NULL : &draft->labels->label[kind][labels[kind][piece]];
		enum tw_status status = write_name(draft, piece, label);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

enum tw_status draft_find_pieces(struct draft *draft)
{
	enum tw_status status = number_pieces(draft);
	if (status == TW_OK)
		status = part_coords(draft);
	if (status == TW_OK)
		status = name_pieces(draft);
	return status;
}
