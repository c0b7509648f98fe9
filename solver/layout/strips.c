/* A stretch of a wire in one piece becomes one loop and is cut at the cut line. What lies beyond the cut line is found
 * part by part, each part a few millimetres long: it is laid on the piece behind, as far from the seam as it was and
 * beside the same point of it. Where a wire crosses a seam at an angle, the corners of its strip come from both sides.
 */
#include "solver/layout/strips.h"

#include "solver/curve/ribbon.h"

#include <string.h>

static const double part_mm = 3;       /* of a wire; what lies beyond a bent seam follows it in such steps */
static const double beyond_mm2 = 1e-3; /* less than this beyond a cut line is a matter of rounding */
static const double seam_lap_mm = 0.5; /* a stretch goes on so far beyond a seam: no gap to what comes from behind it */

/* The areas of one wire while they are collected, piece by piece. */
struct collector {
	const struct strip_cutter *cutter;
	uint32_t *piece; /* [count], ascending */
	struct region_builder *builder;
	uint32_t count;
	double width;
};

enum tw_status strip_cutter_init(struct strip_cutter *cutter, struct arena *arena, struct arena *scratch,
				 const struct garment *garment, const struct topology *topology,
				 const struct outline *outline, struct tw_error *error)
{
	*cutter = (struct strip_cutter){garment, topology, outline, NULL, arena, scratch};
	cutter->piece = ARENA_ARRAY(arena, garment->piece_count, struct region);
	struct region_builder builder;
	uint32_t l = 0;
	for (uint32_t p = 0; cutter->piece && p < garment->piece_count; p++) {
		region_start(&builder, arena);
		for (; l < outline->loop_count && outline->loop[l].piece == p; l++) {
			region_begin_loop(&builder);
			for (uint32_t i = 0; i < outline->loop[l].count; i++) {
				struct vec2 from, to;
				outline_ends(outline, garment, outline->loop[l].first + i, &from, &to);
				region_add_point(&builder, from);
			}
		}
		cutter->piece[p] = builder.region;
		if (builder.failed)
			return tw_fail_memory(error);
	}
	return cutter->piece ? TW_OK : tw_fail_memory(error);
}

static struct region_builder *builder_of(struct collector *collector, uint32_t piece)
{
	uint32_t i = 0;
	while (i < collector->count && collector->piece[i] < piece)
		i++;
	if (i < collector->count && collector->piece[i] == piece)
		return &collector->builder[i];
	uint32_t behind = collector->count - i;
	memmove(collector->piece + i + 1, collector->piece + i, behind * sizeof *collector->piece);
	memmove(collector->builder + i + 1, collector->builder + i, behind * sizeof *collector->builder);
	collector->piece[i] = piece;
	collector->count++;
	region_start(&collector->builder[i], collector->cutter->scratch);
	return &collector->builder[i];
}

/* --- the own piece ------------------------------------------------------------------------------------------------ */

static enum tw_status add_stretch(struct collector *collector, const struct span *span, uint32_t count, bool goes_back,
				  bool goes_on, struct tw_error *error)
{
	struct span *whole = ARENA_ARRAY(collector->cutter->scratch, (size_t)count + 2, struct span);
	uint32_t made = 0, piece = span->piece;
	if (!whole)
		return tw_fail_memory(error);
	if (goes_back) {
		struct vec2 at = span->from;
		whole[made++] = span_line(vec2_along(at, span_direction(span, 0), -seam_lap_mm), at, piece);
	}
	memcpy(whole + made, span, count * sizeof *span);
	made += count;
	if (goes_on) {
		struct vec2 at = span[count - 1].to;
		whole[made++] = span_line(at, vec2_along(at, span_direction(&span[count - 1], 1), seam_lap_mm), piece);
	}
	ribbon_add(builder_of(collector, piece), whole, made, collector->width);
	return TW_OK;
}

/* --- beyond seams ------------------------------------------------------------------------------------------------- */

/* The nearest segment of a piece's cut line; where `like` is given, of the same side of the same seam. */
static uint32_t nearest_segment(const struct strip_cutter *cutter, uint32_t piece, struct vec2 point,
				const struct outline_segment *like)
{
	const struct outline *outline = cutter->outline;
	uint32_t nearest = GARMENT_NONE;
	double best = INFINITY;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		const struct outline_segment *segment = &outline->segment[i];
		struct vec2 from, to;
		if (like && (segment->seam != like->seam || segment->side != like->side))
			continue;
		outline_ends(outline, cutter->garment, i, &from, &to);
		double distance = vec2_distance(point, vec2_mix(from, to, vec2_nearest(from, to, point)));
		if (distance < best) {
			best = distance;
			nearest = i;
		}
	}
	return nearest;
}

static struct vec2 coord_of(const struct garment *garment, uint32_t coord)
{
	const double *uv = &garment->pattern[2 * (size_t)coord];
	return (struct vec2){uv[0], uv[1]};
}

/* The piece behind a seam segment, and where the segment's ends lie there. False where there is none. */
static bool look_behind(const struct strip_cutter *cutter, const struct outline_segment *segment, uint32_t *piece,
			struct vec2 *from, struct vec2 *to)
{
	const uint32_t *pair = &cutter->topology->edge_face[2 * (size_t)segment->edge];
	uint32_t side = pair[0] == segment->face ? 1 : 0, face = pair[side];
	if (segment->seam == GARMENT_NONE || face == GARMENT_NONE || pair[0] == pair[1])
		return false;
	uint32_t k = cutter->topology->edge_side[2 * (size_t)segment->edge + side];
	const uint32_t *coord = &cutter->garment->face_coord[3 * (size_t)face];
	/* The face behind walks its side the other way round. */
	*from = coord_of(cutter->garment, coord[(k + 1) % 3]);
	*to = coord_of(cutter->garment, coord[k]);
	*piece = cutter->garment->face_piece[face];
	return true;
}

/* Lays a point beyond a seam on the piece behind: beside the same point of the seam, and as far from it. */
static struct vec2 lay_behind(const struct strip_cutter *cutter, uint32_t piece, struct vec2 point,
			      const struct outline_segment *seam)
{
	struct vec2 from, to, from_behind, to_behind;
	uint32_t i = nearest_segment(cutter, piece, point, seam), behind;
	outline_ends(cutter->outline, cutter->garment, i, &from, &to);
	if (!look_behind(cutter, &cutter->outline->segment[i], &behind, &from_behind, &to_behind))
		return point;
	double t = vec2_nearest(from, to, point);
	struct vec2 here = vec2_unit(vec2_sub(to, from)), there = vec2_unit(vec2_sub(to_behind, from_behind));
	struct vec2 turn = {vec2_dot(here, there), vec2_cross(here, there)};
	struct vec2 away = vec2_sub(point, vec2_mix(from, to, t));
	return vec2_add(vec2_mix(from_behind, to_behind, t), vec2_rotate(away, turn));
}

static void add_behind(struct collector *collector, uint32_t piece, const struct region *beyond, uint32_t loop)
{
	const struct strip_cutter *cutter = collector->cutter;
	struct vec2 centroid, from, to;
	uint32_t behind;
	if (region_loop_area(beyond, loop, &centroid) < beyond_mm2)
		return;
	uint32_t nearest = nearest_segment(cutter, piece, centroid, NULL);
	const struct outline_segment *seam = &cutter->outline->segment[nearest];
	if (!look_behind(cutter, seam, &behind, &from, &to))
		return;
	struct region_builder *builder = builder_of(collector, behind);
	region_begin_loop(builder);
	for (uint32_t i = beyond->first[loop]; i < beyond->first[loop + 1]; i++)
		region_add_point(builder, lay_behind(cutter, piece, beyond->point[i], seam));
}

static enum tw_status add_beyond_part(struct collector *collector, const struct span *part, struct tw_error *error)
{
	const struct strip_cutter *cutter = collector->cutter;
	struct region_builder quad;
	struct region beyond;
	struct vec2 middle = span_point(part, 0.5);
	double room = outline_distance(cutter->outline, cutter->garment, part->piece, middle, NULL);
	if (room > collector->width / 2 + part_mm)
		return TW_OK;
	region_start(&quad, cutter->scratch);
	ribbon_add(&quad, part, 1, collector->width);
	if (quad.failed)
		return tw_fail_memory(error);
	enum tw_status status = region_combine(&beyond, cutter->scratch, cutter->arena, &quad.region,
					       &cutter->piece[part->piece], REGION_LESS, error);
	for (uint32_t l = 0; status == TW_OK && l < beyond.loop_count; l++)
		add_behind(collector, part->piece, &beyond, l);
	return status;
}

static enum tw_status add_beyond(struct collector *collector, const struct span *span, struct tw_error *error)
{
	uint32_t parts = (uint32_t)(span_length(span) / part_mm) + 1;
	enum tw_status status = TW_OK;
	for (uint32_t i = 0; i < parts && status == TW_OK; i++) {
		struct span part = span_part(span, (double)i / parts, (i + 1.0) / parts);
		status = add_beyond_part(collector, &part, error);
	}
	return status;
}

/* --- all together ------------------------------------------------------------------------------------------------- */

static enum tw_status collect(struct collector *collector, const struct span *span, uint32_t span_count,
			      struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (uint32_t s = 0, end; s < span_count && status == TW_OK; s = end) {
		/* A piece that is sewn to itself is left and entered at once. */
		for (end = s + 1; end < span_count; end++)
			if (!wire_goes_on(&span[end]))
				break;
		status = add_stretch(collector, span + s, end - s, s > 0, end < span_count, error);
	}
	for (uint32_t s = 0; s < span_count && status == TW_OK; s++)
		status = add_beyond(collector, &span[s], error);
	return status;
}

static void find_box(struct strip_area *area)
{
	const struct region *region = &area->region;
	area->low = (struct vec2){INFINITY, INFINITY};
	area->high = (struct vec2){-INFINITY, -INFINITY};
	for (uint32_t i = 0; i < region->first[region->loop_count]; i++) {
		area->low = (struct vec2){fmin(area->low.x, region->point[i].x), fmin(area->low.y, region->point[i].y)};
		area->high =
			(struct vec2){fmax(area->high.x, region->point[i].x), fmax(area->high.y, region->point[i].y)};
	}
}

static enum tw_status cut_off(const struct collector *collector, struct strip_areas *areas, struct tw_error *error)
{
	const struct strip_cutter *cutter = collector->cutter;
	areas->area = ARENA_ARRAY(cutter->arena, collector->count, struct strip_area);
	if (!areas->area)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < collector->count; i++) {
		struct strip_area *area = &areas->area[areas->count];
		area->piece = collector->piece[i];
		if (collector->builder[i].failed)
			return tw_fail_memory(error);
		enum tw_status status =
			region_combine(&area->region, cutter->arena, cutter->scratch, &collector->builder[i].region,
				       &cutter->piece[area->piece], REGION_COMMON, error);
		if (status != TW_OK)
			return status;
		find_box(area);
		areas->count += area->region.loop_count > 0;
	}
	return TW_OK;
}

enum tw_status strips_cut(const struct strip_cutter *cutter, const struct wire *wire, double width,
			  struct strip_areas *areas, struct tw_error *error)
{
	*areas = (struct strip_areas){0};
	struct arena_mark mark = arena_mark(cutter->scratch);
	struct collector collector = {.cutter = cutter, .width = width};
	collector.piece = ARENA_ARRAY(cutter->scratch, cutter->garment->piece_count, uint32_t);
	collector.builder = ARENA_ARRAY(cutter->scratch, cutter->garment->piece_count, struct region_builder);
	enum tw_status status = collector.piece && collector.builder ? TW_OK : tw_fail_memory(error);
	if (status == TW_OK)
		status = collect(&collector, wire->span, wire->span_count, error);
	if (status == TW_OK)
		status = cut_off(&collector, areas, error);
	arena_release(cutter->scratch, mark);
	return status;
}

enum tw_status strips_cut_all(const struct strip_cutter *cutter, const struct wire *wire, uint32_t wire_count,
			      double width, struct strip_areas **areas, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	*areas = ARENA_ARRAY(cutter->arena, wire_count, struct strip_areas);
	if (!*areas)
		return tw_fail_memory(error);
	for (uint32_t w = 0; w < wire_count && status == TW_OK; w++)
		status = strips_cut(cutter, &wire[w], width, &(*areas)[w], error);
	return status;
}
