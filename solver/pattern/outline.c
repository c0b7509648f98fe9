/* The directed boundary segments of all pieces are chained by their pattern positions. Where a piece touches itself in
 * a point, two chains pass through it; each takes the first segment that is still free, which closes every loop. Seams
 * are grown along the loops: two neighbouring segments belong to one seam when their partners on the other side are
 * neighbours too. */
#include "solver/pattern/outline.h"

#include <stdbool.h>
#include <stdlib.h>

static struct vec2 coord_of(const struct garment *garment, uint32_t coord)
{
	const double *uv = &garment->pattern[2 * (size_t)coord];
	return (struct vec2){uv[0], uv[1]};
}

void outline_ends(const struct outline *outline, const struct garment *garment, uint32_t segment, struct vec2 *from,
		  struct vec2 *to)
{
	*from = coord_of(garment, outline->segment[segment].from);
	*to = coord_of(garment, outline->segment[segment].to);
}

struct builder {
	struct outline *outline;
	const struct garment *garment;
	const struct topology *topology;
	struct outline_segment *loose; /* [segment_count] in order of piece, then of edge */
	uint32_t *next_of_coord;       /* [coord_count] first loose segment that starts there */
	uint32_t *next_same;           /* [segment_count] another one that starts at the same position */
	uint32_t *partner;             /* [edge_count][2] final segment of each side of a seam edge */
};

static uint32_t count_segments(const struct topology *topology)
{
	uint32_t count = 0;
	for (uint32_t e = 0; e < topology->edge_count; e++)
		count += topology->edge_kind[e] == EDGE_SEAM ? 2 : topology->edge_kind[e] == EDGE_HEM;
	return count;
}

static void collect_side(struct builder *builder, uint32_t edge, uint32_t side, uint32_t *slot)
{
	uint32_t face = builder->topology->edge_face[2 * (size_t)edge + side];
	uint32_t k = builder->topology->edge_side[2 * (size_t)edge + side];
	const uint32_t *coord = &builder->garment->face_coord[3 * (size_t)face];
	builder->loose[(*slot)++] = (struct outline_segment){
		.edge = edge, .face = face, .from = coord[k], .to = coord[(k + 1) % 3], .seam = GARMENT_NONE};
}

/* Counting sort by piece keeps the order of edges within a piece. */
static void collect(struct builder *builder, uint32_t *slot)
{
	const struct topology *topology = builder->topology;
	const uint32_t *piece = builder->garment->face_piece;
	uint32_t *first = builder->outline->piece_first;
	for (int pass = 0; pass < 2; pass++) {
		for (uint32_t e = 0; e < topology->edge_count; e++) {
			uint32_t sides = topology->edge_kind[e] == EDGE_SEAM  ? 2
					 : topology->edge_kind[e] == EDGE_HEM ? 1
									      : 0;
			for (uint32_t s = 0; s < sides; s++) {
				uint32_t p = piece[topology->edge_face[2 * (size_t)e + s]];
				if (pass == 0)
					first[p + 1]++;
				else
					collect_side(builder, e, s, &slot[p]);
			}
		}
		for (uint32_t p = 0; pass == 0 && p < builder->garment->piece_count; p++) {
			first[p + 1] += first[p];
			slot[p] = first[p];
		}
	}
}

static void chain(struct builder *builder)
{
	struct outline *outline = builder->outline;
	for (uint32_t i = outline->segment_count; i-- > 0;) {
		uint32_t *head = &builder->next_of_coord[builder->loose[i].from];
		builder->next_same[i] = *head;
		*head = i;
	}
	uint32_t placed = 0;
	for (uint32_t start = 0; start < outline->segment_count; start++) {
		if (builder->loose[start].face == GARMENT_NONE)
			continue;
		struct outline_loop *loop = &outline->loop[outline->loop_count++];
		*loop = (struct outline_loop){.first = placed,
					      .piece = builder->garment->face_piece[builder->loose[start].face]};
		for (uint32_t i = start; i != GARMENT_NONE;) {
			outline->segment[placed++] = builder->loose[i];
			builder->loose[i].face = GARMENT_NONE;
			i = builder->next_of_coord[builder->loose[i].to];
			while (i != GARMENT_NONE && builder->loose[i].face == GARMENT_NONE)
				i = builder->next_same[i];
		}
		loop->count = placed - loop->first;
	}
}

static uint32_t partner_of(const struct builder *builder, uint32_t segment)
{
	uint32_t edge = builder->outline->segment[segment].edge;
	const uint32_t *pair = &builder->partner[2 * (size_t)edge];
	if (builder->topology->edge_kind[edge] != EDGE_SEAM)
		return GARMENT_NONE;
	return pair[0] == segment ? pair[1] : pair[0];
}

/* Whether segment j, the successor of i, goes on with the seam of i. */
static bool seam_goes_on(const struct builder *builder, uint32_t i, uint32_t j)
{
	uint32_t a = partner_of(builder, i), b = partner_of(builder, j);
	return a != GARMENT_NONE && b != GARMENT_NONE &&
	       builder->outline->segment[b].to == builder->outline->segment[a].from;
}

static void add_to_seam(struct builder *builder, uint32_t seam, uint32_t segment)
{
	struct outline *outline = builder->outline;
	uint32_t pair[2] = {segment, partner_of(builder, segment)};
	for (int side = 0; side < 2; side++) {
		struct vec2 from, to;
		outline_ends(outline, builder->garment, pair[side], &from, &to);
		outline->segment[pair[side]].seam = seam;
		outline->segment[pair[side]].side = (uint32_t)side;
		outline->seam[seam].length_mm[side] += vec2_distance(from, to);
		outline->seam[seam].piece[side] = builder->garment->face_piece[outline->segment[pair[side]].face];
	}
}

static void find_seams(struct builder *builder)
{
	struct outline *outline = builder->outline;
	for (uint32_t l = 0; l < outline->loop_count; l++) {
		const struct outline_loop *loop = &outline->loop[l];
		/* Begin where no seam is cut in two by the loop's arbitrary start. */
		uint32_t shift = 0;
		for (uint32_t i = 0; i < loop->count; i++) {
			uint32_t before = loop->first + (i + loop->count - 1) % loop->count;
			if (!seam_goes_on(builder, before, loop->first + i)) {
				shift = i;
				break;
			}
		}
		for (uint32_t n = 0; n < loop->count; n++) {
			uint32_t i = loop->first + (shift + n) % loop->count;
			uint32_t before = loop->first + (shift + n + loop->count - 1) % loop->count;
			if (partner_of(builder, i) == GARMENT_NONE || outline->segment[i].seam != GARMENT_NONE)
				continue;
			bool goes_on = n > 0 && seam_goes_on(builder, before, i);
			uint32_t seam = goes_on ? outline->segment[before].seam : outline->seam_count++;
			add_to_seam(builder, seam, i);
		}
	}
}

enum tw_status outline_build(struct outline *outline, struct arena *arena, const struct garment *garment,
			     const struct topology *topology, struct tw_error *error)
{
	*outline = (struct outline){.segment_count = count_segments(topology)};
	struct builder builder = {.outline = outline, .garment = garment, .topology = topology};
	size_t segments = outline->segment_count;
	outline->segment = ARENA_ARRAY(arena, segments, struct outline_segment);
	outline->loop = ARENA_ARRAY(arena, segments, struct outline_loop);
	outline->seam = ARENA_ZEROED(arena, segments, struct outline_seam);
	outline->piece_first = ARENA_ZEROED(arena, (size_t)garment->piece_count + 1, uint32_t);
	struct arena_mark mark = arena_mark(arena);
	uint32_t *slot = ARENA_ARRAY(arena, garment->piece_count, uint32_t);
	builder.loose = ARENA_ARRAY(arena, segments, struct outline_segment);
	builder.next_of_coord = ARENA_ARRAY(arena, garment->coord_count, uint32_t);
	builder.next_same = ARENA_ARRAY(arena, segments, uint32_t);
	builder.partner = ARENA_ARRAY(arena, 2 * (size_t)topology->edge_count, uint32_t);
	if (!outline->segment || !outline->loop || !outline->seam || !outline->piece_first || !slot || !builder.loose ||
	    !builder.next_of_coord || !builder.next_same || !builder.partner)
		return tw_fail_memory(error);
	collect(&builder, slot);
	for (uint32_t c = 0; c < garment->coord_count; c++)
		builder.next_of_coord[c] = GARMENT_NONE;
	for (size_t i = 0; i < 2 * (size_t)topology->edge_count; i++)
		builder.partner[i] = GARMENT_NONE;
	chain(&builder);
	for (uint32_t i = 0; i < outline->segment_count; i++) {
		uint32_t *pair = builder.partner + 2 * (size_t)outline->segment[i].edge;
		pair[pair[0] != GARMENT_NONE] = i;
	}
	find_seams(&builder);
	arena_release(arena, mark);
	return TW_OK;
}

double outline_distance(const struct outline *outline, const struct garment *garment, uint32_t piece, struct vec2 point,
			uint32_t *segment)
{
	double best = INFINITY;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		struct vec2 from, to;
		outline_ends(outline, garment, i, &from, &to);
		double distance = vec2_distance(point, vec2_mix(from, to, vec2_nearest(from, to, point)));
		if (distance >= best)
			continue;
		best = distance;
		if (segment)
			*segment = i;
	}
	return best;
}

/* A ray to the right leaves the piece as often as it enters, and once more from within. */
bool outline_contains(const struct outline *outline, const struct garment *garment, uint32_t piece, struct vec2 point)
{
	bool contained = false;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		struct vec2 from, to;
		outline_ends(outline, garment, i, &from, &to);
		if ((from.y > point.y) == (to.y > point.y))
			continue;
		double side = vec2_cross(vec2_sub(to, from), vec2_sub(point, from));
		if (to.y > from.y ? side > 0 : side < 0)
			contained = !contained;
	}
	return contained;
}

static bool same_side(const struct outline_segment *a, const struct outline_segment *b)
{
	return a->seam == b->seam && a->side == b->side;
}

/* A place in the loop where a side of a seam begins, so that none is met in two parts. */
static uint32_t begin_of_side(const struct outline *outline, const struct outline_loop *loop)
{
	const struct outline_segment *segment = &outline->segment[loop->first];
	for (uint32_t i = 0; i < loop->count; i++)
		if (!same_side(&segment[(i + loop->count - 1) % loop->count], &segment[i]))
			return i;
	return 0;
}

enum tw_status outline_seam_middles(const struct outline *outline, const struct garment *garment, struct arena *arena,
				    struct seam_middle (**middle)[2], struct tw_error *error)
{
	struct seam_middle(*found)[2] = arena_zeroed(arena, outline->seam_count, sizeof *found);
	*middle = found;
	if (!found)
		return tw_fail_memory(error);
	for (uint32_t l = 0; l < outline->loop_count; l++) {
		const struct outline_loop *loop = &outline->loop[l];
		uint32_t begin = begin_of_side(outline, loop);
		const struct outline_segment *last = NULL;
		double run = 0;
		for (uint32_t n = 0; n < loop->count; n++) {
			uint32_t i = loop->first + (begin + n) % loop->count;
			const struct outline_segment *segment = &outline->segment[i];
			struct vec2 from, to;
			outline_ends(outline, garment, i, &from, &to);
			run = last && same_side(last, segment) ? run : 0;
			last = segment;
			double before = run, length = vec2_distance(from, to);
			run += length;
			if (segment->seam == GARMENT_NONE)
				continue;
			double half = outline->seam[segment->seam].length_mm[segment->side] / 2;
			if (half < before || half >= run)
				continue;
			found[segment->seam][segment->side] = (struct seam_middle){
				.piece = loop->piece,
				.at = vec2_mix(from, to, length > 0 ? (half - before) / length : 0),
				.inward = vec2_left(vec2_unit(vec2_sub(to, from)))};
		}
	}
	return TW_OK;
}
