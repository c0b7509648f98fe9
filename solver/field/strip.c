/* Walking a strip: a flood within one placement of one piece, and a short list of seam crossings that wait.
 *
 * A placement is the rigid motion that takes the pattern into the strip's own plane. Within it faces are flooded in any
 * order, since each has its place already; what meets a seam is put aside, and when the flood has ended, the crossing
 * nearest to the strip's middle lays the next piece. Faces are marked with the number of the strip, so that nothing has
 * to be cleared between strips. */
#include "solver/field/strip.h"

#include "solver/field/chord.h"
#include "solver/field/clip.h"
#include "solver/field/clones.h"
#include "solver/garment/first_corner.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#define NEGLIGIBLE_SHARE 1e-6 /* of the strip: a face that covers less has no say in what missing fabric costs */

#define SMALLEST_AREA_MM2 1e-9 /* of a strip; what is smaller has no inside that could be told from its sides */
#define LARGEST_AREA_MM2 1e12  /* a square kilometre; what is larger is no strip */
#define NEGLIGIBLE_PART 1e-9   /* of a side: a strip that meets less does not cross it, so that rounding opens no way */

enum link { LINK_SIDE = 3, LINK_SEAM = 4, LINK_BITS = 4, LINK_FIRST = 3 * LINK_BITS };
enum { ALL_SIDES = 7 }; /* a bit each */

/* Exactly a cache line. The corners begin with face_first_corner's, whatever corner the file begins with, so that
 * strips are the same to the last bit; what a side is called here is the file's less that corner. */
struct strip_face {
	double uv[6];     /* pattern position of the corners, mm: the three u, then the three v */
	uint32_t next[3]; /* the face across each side; at a hem face_count, which counts as entered always */
	uint32_t link;    /* LINK_BITS for each side: the neighbour's side, and whether a seam is between; behind them
			     the file's number of the first corner */
};

struct placement {
	double c, s, x, y; /* (u, v) -> (c u - s v + x, s u + c v + y) */
};

struct crossing {
	uint32_t face;
	double distance; /* from the strip's middle, squared */
	struct placement placement;
};

struct strip_walker {
	const struct strip_fabric *fabric; /* borrowed */
	uint32_t turn;                     /* number of the strip */
	uint32_t *entered;                 /* [face_count + 1] turn in which the face was entered last */
	uint32_t *queue;           /* [face_count + 1] faces of the flood, and room for one that does not stay */
	struct crossing *crossing; /* one for each side of each seam edge, and one */
	uint32_t crossing_count;
};

/* What is laid on the fabric, in its own plane. */
struct shape {
	bool is_box;
	struct box box;
	struct convex convex;
	double area;
	double middle[2];
	uint32_t open_sides; /* of the first face, a bit each: half a strip does not cross the seam it lies along */
};

/* A side of the garment's face as it is numbered here. */
static uint32_t own_side(const struct strip_face *face, uint32_t side)
{
	return (side + 3 - (face->link >> LINK_FIRST)) % 3;
}

static void link_side(struct strip_face *face, uint32_t side, uint32_t next, uint32_t next_side, bool seam)
{
	face->next[side] = next;
	face->link |= (next_side | (seam ? LINK_SEAM : 0)) << (LINK_BITS * side);
}

enum tw_status strip_fabric_build(struct strip_fabric *fabric, struct arena *arena, const struct garment *garment,
				  const struct topology *topology, const double *value, struct tw_error *error)
{
	static_assert(sizeof(struct strip_face) == 64, "a face is a cache line");
	struct strip_face *face = ARENA_ARRAY(arena, garment->face_count, struct strip_face);
	if (!face)
		return tw_fail_memory(error);
	*fabric = (struct strip_fabric){garment, topology, value, face};
	for (size_t f = 0; f < garment->face_count; f++) {
		uint32_t first = face_first_corner(garment, (uint32_t)f);
		face[f] = (struct strip_face){.next = {garment->face_count, garment->face_count, garment->face_count},
					      .link = first << LINK_FIRST};
		for (size_t k = 0; k < 3; k++) {
			const double *at = garment->pattern + 2 * (size_t)garment->face_coord[3 * f + (first + k) % 3];
			face[f].uv[k] = at[0];
			face[f].uv[3 + k] = at[1];
		}
	}
	for (size_t e = 0; e < topology->edge_count; e++) {
		uint32_t f = topology->edge_face[2 * e], g = topology->edge_face[2 * e + 1];
		bool seam = topology->edge_kind[e] == EDGE_SEAM;
		if (g == GARMENT_NONE)
			continue;
		uint32_t side_f = own_side(&face[f], topology->edge_side[2 * e]);
		uint32_t side_g = own_side(&face[g], topology->edge_side[2 * e + 1]);
		link_side(&face[f], side_f, g, side_g, seam);
		link_side(&face[g], side_g, f, side_f, seam);
	}
	return TW_OK;
}

enum tw_status strip_walker_new(struct strip_walker **out, struct arena *arena, const struct strip_fabric *fabric,
				struct tw_error *error)
{
	size_t faces = fabric->garment->face_count, seam_sides = 0;
	for (uint32_t e = 0; e < fabric->topology->edge_count; e++)
		seam_sides += fabric->topology->edge_kind[e] == EDGE_SEAM ? 2 : 0;
	struct strip_walker *walker = ARENA_ZEROED(arena, 1, struct strip_walker);
	if (!walker)
		return tw_fail_memory(error);
	walker->fabric = fabric;
	walker->entered = ARENA_ZEROED(arena, faces + 1, uint32_t);
	walker->queue = ARENA_ARRAY(arena, faces + 1, uint32_t);
	walker->crossing = ARENA_ARRAY(arena, seam_sides + 1, struct crossing);
	if (!walker->entered || !walker->queue || !walker->crossing)
		return tw_fail_memory(error);
	*out = walker;
	return TW_OK;
}

static void begin_turn(struct strip_walker *walker)
{
	uint32_t faces = walker->fabric->garment->face_count;
	if (++walker->turn == 0) {
		memset(walker->entered, 0, faces * sizeof *walker->entered);
		walker->turn = 1;
	}
	walker->entered[faces] = walker->turn;
	walker->crossing_count = 0;
}

/* A side of a face in its pattern, from a to b. */
struct side {
	double a[2], b[2];
};

static struct side face_side(const struct strip_face *face, uint32_t side)
{
	uint32_t end = side == 2 ? 0 : side + 1;
	return (struct side){{face->uv[side], face->uv[3 + side]}, {face->uv[end], face->uv[3 + end]}};
}

/* Lays the neighbour's side against ours from p to q, midpoint on midpoint, running the other way. */
static struct placement place_across(const struct side *next, double px, double py, double qx, double qy)
{
	double tx = px - qx, ty = py - qy, nx = next->b[0] - next->a[0], ny = next->b[1] - next->a[1];
	double scale = 1 / sqrt((tx * tx + ty * ty) * (nx * nx + ny * ny));
	double c = (tx * nx + ty * ny) * scale, s = (ty * nx - tx * ny) * scale;
	double mx = 0.5 * (next->a[0] + next->b[0]), my = 0.5 * (next->a[1] + next->b[1]);
	return (struct placement){c, s, 0.5 * (px + qx) - (c * mx - s * my), 0.5 * (py + qy) - (s * mx + c * my)};
}

static void await_crossing(struct strip_walker *walker, const struct shape *shape, uint32_t face, uint32_t k,
			   const four *x, const four *y, double t)
{
	const struct strip_face *from = &walker->fabric->face[face];
	uint32_t next = from->next[k], l = k == 2 ? 0 : k + 1;
	double px = (*x)[k], py = (*y)[k], qx = (*x)[l], qy = (*y)[l];
	double dx = px + t * (qx - px) - shape->middle[0], dy = py + t * (qy - py) - shape->middle[1];
	struct side side = face_side(&walker->fabric->face[next], from->link >> (LINK_BITS * k) & LINK_SIDE);
	walker->crossing[walker->crossing_count++] = (struct crossing){
		.face = next,
		.distance = dx * dx + dy * dy,
		.placement = place_across(&side, px, py, qx, qy),
	};
}

static inline __attribute__((always_inline)) void account(struct strip *strip, double area, double value)
{
	double weighty = area > NEGLIGIBLE_SHARE * strip->area_mm2 ? value : 0;
	strip->covered_mm2 += area;
	strip->cost += area * value;
	strip->face_count++;
	strip->largest = weighty > strip->largest ? weighty : strip->largest;
}

/* The part of a face within the shape: its area, and what of each side lies within. */
static inline __attribute__((always_inline)) double clip_face(const struct shape *shape, bool is_box, const four *x,
							      const four *y, struct sides *sides)
{
	if (is_box) {
		box_clip_sides(&shape->box, x, y, sides);
		return sides->share[0] + sides->share[1] + sides->share[2];
	}
	double cx[3], cy[3];
	for (int k = 0; k < 3; k++) {
		int l = k == 2 ? 0 : k + 1;
		cx[k] = (*x)[k];
		cy[k] = (*y)[k];
		struct span span = convex_clip_side(&shape->convex, cx[k], cy[k], (*x)[l], (*y)[l]);
		sides->inside[k] = span.out - span.in;
		sides->middle[k] = 0.5 * (span.in + span.out);
	}
	return convex_clip_area(&shape->convex, cx, cy);
}

/* The corners of a face, placed. Four are read; the fourth lane is of no use. */
static inline __attribute__((always_inline)) void place_corners(const struct strip_face *face,
								const struct placement *at, four *x, four *y)
{
	four u, v;
	memcpy(&u, face->uv, sizeof u);
	memcpy(&v, face->uv + 2, sizeof v);
	u = __builtin_shufflevector(u, u, 0, 1, 2, 0);
	v = __builtin_shufflevector(v, v, 1, 2, 3, 1);
	*x = at->c * u - at->s * v + at->x;
	*y = at->s * u + at->c * v + at->y;
}

/* Takes every face that the strip reaches within the crossing's placement. Whether a side leads on is as good as
 * random, so what it leads to is put into the queue in any case, and stays there or not; nor is there a choice for a
 * compiler to make a jump of. First in, first out: the next face is known before this one is done, and the processor
 * works on both. */
static inline __attribute__((always_inline)) void flood(struct strip_walker *walker, const struct shape *shape,
							const bool is_box, const struct crossing *start,
							uint32_t open_sides, struct strip *result)
{
	const struct strip_face *faces = walker->fabric->face;
	const double *value = walker->fabric->value;
	const struct placement at = start->placement;
	uint32_t *entered = walker->entered, *queue = walker->queue, head = 0, tail = 0;
	const uint32_t turn = walker->turn;
	struct strip strip = *result;
	queue[tail++] = start->face;
	entered[start->face] = turn;
	while (head < tail) {
		uint32_t f = queue[head++];
		const struct strip_face *face = &faces[f];
		four x, y;
		struct sides sides;
		place_corners(face, &at, &x, &y);
		account(&strip, clip_face(shape, is_box, &x, &y, &sides), value[f]);
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t g = face->next[k], seam = face->link >> (LINK_BITS * k) & LINK_SEAM;
			bool leads = (sides.inside[k] > NEGLIGIBLE_PART) & (open_sides >> k) & (entered[g] != turn);
			bool stays = leads & !seam;
			queue[tail] = g;
			entered[g] ^= (entered[g] ^ turn) & (0 - (uint32_t)stays);
			tail += stays;
			if (leads & !!seam)
				await_crossing(walker, shape, f, k, &x, &y, sides.middle[k]);
		}
		open_sides = ALL_SIDES;
	}
	*result = strip;
}

/* One for each shape, so that neither pays for the other. */
typedef void flooding(struct strip_walker *walker, const struct shape *shape, const struct crossing *start,
		      uint32_t open_sides, struct strip *result);

CLONES static void flood_box(struct strip_walker *walker, const struct shape *shape, const struct crossing *start,
			     uint32_t open_sides, struct strip *result)
{
	flood(walker, shape, true, start, open_sides, result);
}

static void flood_convex(struct strip_walker *walker, const struct shape *shape, const struct crossing *start,
			 uint32_t open_sides, struct strip *result)
{
	flood(walker, shape, false, start, open_sides, result);
}

static struct crossing take_nearest(struct strip_walker *walker)
{
	uint32_t nearest = 0;
	for (uint32_t i = 1; i < walker->crossing_count; i++)
		if (walker->crossing[i].distance < walker->crossing[nearest].distance)
			nearest = i;
	struct crossing crossing = walker->crossing[nearest];
	walker->crossing[nearest] = walker->crossing[--walker->crossing_count];
	return crossing;
}

static void walk(struct strip_walker *walker, const struct shape *shape, uint32_t face, struct placement placement,
		 struct strip *strip)
{
	flooding *const flood_shape = shape->is_box ? flood_box : flood_convex;
	*strip = (struct strip){.area_mm2 = shape->area};
	begin_turn(walker);
	flood_shape(walker, shape, &(struct crossing){face, 0, placement}, shape->open_sides, strip);
	while (walker->crossing_count > 0) {
		struct crossing crossing = take_nearest(walker);
		if (walker->entered[crossing.face] != walker->turn)
			flood_shape(walker, shape, &crossing, ALL_SIDES, strip);
	}
	/* What meets no cloth, or hardly any, is priced like the cloth that is nearest. */
	if (strip->covered_mm2 <= NEGLIGIBLE_SHARE * strip->area_mm2)
		strip->largest = walker->fabric->value[face];
}

/* Beside a bent seam unfolded pieces overlap: no strip holds more cloth than its own area. */
static void count_once(struct strip *strip)
{
	if (strip->covered_mm2 <= strip->area_mm2)
		return;
	strip->cost *= strip->area_mm2 / strip->covered_mm2;
	strip->covered_mm2 = strip->area_mm2;
}

void strip_polygon(struct strip_walker *walker, uint32_t face, const double *corner, uint32_t corner_count,
		   struct strip *strip)
{
	assert(corner_count >= 3 && corner_count <= STRIP_CORNERS);
	struct shape shape = {.convex.count = corner_count, .open_sides = ALL_SIDES};
	for (uint32_t i = 0; i < corner_count; i++) {
		shape.convex.x[i] = corner[2 * i];
		shape.convex.y[i] = corner[2 * i + 1];
	}
	shape.area = convex_area(corner_count, shape.convex.x, shape.convex.y);
	for (uint32_t i = 0; shape.area < 0 && i < corner_count; i++) {
		shape.convex.x[i] = corner[2 * (corner_count - 1 - i)];
		shape.convex.y[i] = corner[2 * (corner_count - 1 - i) + 1];
	}
	shape.area = fabs(shape.area);
	*strip = (struct strip){0};
	if (!(shape.area > SMALLEST_AREA_MM2 && shape.area < LARGEST_AREA_MM2))
		return;
	for (uint32_t i = 0; i < corner_count; i++)
		for (uint32_t d = 0; d < 2; d++)
			shape.middle[d] += corner[2 * i + d] / corner_count;
	walk(walker, &shape, face, (struct placement){1, 0, 0, 0}, strip);
	count_once(strip);
}

/* The plane whose origin is a and whose first axis points to b. */
static struct placement place_along(const double a[2], const double b[2], double *length)
{
	double dx = b[0] - a[0], dy = b[1] - a[1];
	*length = sqrt(dx * dx + dy * dy);
	double c = dx / *length, s = -dy / *length;
	return (struct placement){c, s, -(c * a[0] - s * a[1]), -(s * a[0] + c * a[1])};
}

static void walk_box(struct strip_walker *walker, uint32_t face, const struct side *midline, double low, double high,
		     uint32_t open_sides, struct strip *strip)
{
	double length;
	struct placement placement = place_along(midline->a, midline->b, &length);
	struct shape shape = {
		.is_box = true,
		.box = {length, low, high},
		.area = length * (high - low),
		.middle = {0.5 * length, 0.5 * (low + high)},
		.open_sides = open_sides,
	};
	walk(walker, &shape, face, placement, strip);
}

void strip_segment(struct strip_walker *walker, uint32_t face, const double a[2], const double b[2], double width_mm,
		   struct strip *strip)
{
	*strip = (struct strip){0};
	double dx = b[0] - a[0], dy = b[1] - a[1], area = sqrt(dx * dx + dy * dy) * width_mm;
	if (area > SMALLEST_AREA_MM2 && area < LARGEST_AREA_MM2)
		walk_box(walker, face, &(struct side){{a[0], a[1]}, {b[0], b[1]}}, -0.5 * width_mm, 0.5 * width_mm,
			 ALL_SIDES, strip);
	count_once(strip);
}

static bool runs_upwards(const struct side *side)
{
	return side->a[0] < side->b[0] || (side->a[0] == side->b[0] && side->a[1] < side->b[1]);
}

void strip_edge(struct strip_walker *walker, uint32_t edge, double width_mm, struct strip *strip)
{
	const struct topology *topology = walker->fabric->topology;
	const uint32_t *face = topology->edge_face + 2 * (size_t)edge;
	const bool inner = topology->edge_kind[edge] == EDGE_INNER;
	const double half = 0.5 * width_mm;
	struct strip part[2] = {0};
	for (uint32_t i = 0; i < 2 && face[i] != GARMENT_NONE; i++) {
		const struct strip_face *at = &walker->fabric->face[face[i]];
		uint32_t side = own_side(at, topology->edge_side[2 * (size_t)edge + i]);
		struct side midline = face_side(at, side);
		/* An inner edge has one strip, laid from the face along which it runs upwards: not from the first. */
		if (inner && !runs_upwards(&midline))
			continue;
		uint32_t open_sides = inner ? ALL_SIDES : ALL_SIDES & ~(1u << side);
		walk_box(walker, face[i], &midline, inner ? -half : 0, half, open_sides, &part[i]);
	}
	*strip = part[0];
	strip_add(strip, &part[1]);
	if (topology->edge_kind[edge] == EDGE_HEM)
		strip->area_mm2 *= 2;
	count_once(strip);
}

/* The unfolded pair of an edge's faces in the plane of the first, which is the one whose opposite corner lies lower on
 * the pattern, whatever the numbers of the faces. */
struct pair {
	uint32_t face[2];
	struct side edge;      /* of the first face */
	double opposite[2][2]; /* the corners that are not on the edge */
	uint32_t corner[2];    /* which corners of the faces they are */
};

static void corner_at(const struct strip_face *face, uint32_t corner, double at[2])
{
	at[0] = face->uv[corner];
	at[1] = face->uv[3 + corner];
}

static bool lay_pair(const struct strip_fabric *fabric, uint32_t edge, struct pair *pair)
{
	const uint32_t *face = fabric->topology->edge_face + 2 * (size_t)edge;
	const uint8_t *side = fabric->topology->edge_side + 2 * (size_t)edge;
	if (face[1] == GARMENT_NONE || face[0] == face[1])
		return false;
	uint32_t own[2];
	double at[2][2];
	for (uint32_t i = 0; i < 2; i++) {
		own[i] = own_side(&fabric->face[face[i]], side[i]);
		corner_at(&fabric->face[face[i]], (own[i] + 2) % 3, at[i]);
	}
	const uint32_t first = at[1][0] < at[0][0] || (at[1][0] == at[0][0] && at[1][1] < at[0][1]), other = 1 - first;
	*pair = (struct pair){
		.face = {face[first], face[other]},
		.edge = face_side(&fabric->face[face[first]], own[first]),
		.corner = {(own[first] + 2) % 3, (own[other] + 2) % 3},
	};
	memcpy(pair->opposite[0], at[first], sizeof at[first]);
	memcpy(pair->opposite[1], at[other], sizeof at[other]);
	if (fabric->topology->edge_kind[edge] == EDGE_INNER)
		return true;
	const struct side *here = &pair->edge, there = face_side(&fabric->face[face[other]], own[other]);
	const struct placement laid = place_across(&there, here->a[0], here->a[1], here->b[0], here->b[1]);
	const double u = at[other][0], v = at[other][1];
	pair->opposite[1][0] = laid.c * u - laid.s * v + laid.x;
	pair->opposite[1][1] = laid.s * u + laid.c * v + laid.y;
	return true;
}

/* The garment's vertex at a corner of a face as it is numbered here. */
static uint32_t vertex_at(const struct strip_fabric *fabric, uint32_t face, uint32_t corner)
{
	uint32_t first = fabric->face[face].link >> LINK_FIRST;
	return fabric->garment->face_vertex[3 * (size_t)face + (corner + first) % 3];
}

static bool find_chord(const struct strip_fabric *fabric, uint32_t edge, struct pair *pair, double *share)
{
	return lay_pair(fabric, edge, pair) &&
	       vertex_at(fabric, pair->face[0], pair->corner[0]) != vertex_at(fabric, pair->face[1], pair->corner[1]) &&
	       chord_crosses(pair->edge.a, pair->edge.b, pair->opposite[0], pair->opposite[1], share);
}

bool strip_find_chord(const struct strip_fabric *fabric, uint32_t edge, struct strip_chord *chord)
{
	struct pair pair;
	double share;
	if (!find_chord(fabric, edge, &pair, &share))
		return false;
	const uint32_t begin = vertex_at(fabric, pair.face[0], (pair.corner[0] + 1) % 3);
	const double dx = pair.opposite[1][0] - pair.opposite[0][0], dy = pair.opposite[1][1] - pair.opposite[0][1];
	*chord = (struct strip_chord){
		.face = {pair.face[0], pair.face[1]},
		.along = begin == fabric->topology->edge_vertex[2 * (size_t)edge] ? share : 1 - share,
		.length_mm = sqrt(dx * dx + dy * dy),
	};
	for (uint32_t i = 0; i < 2; i++)
		chord->vertex[i] = vertex_at(fabric, pair.face[i], pair.corner[i]);
	return true;
}

bool strip_chord(struct strip_walker *walker, uint32_t edge, double width_mm, struct strip *strip)
{
	struct pair pair;
	double share;
	*strip = (struct strip){0};
	if (!find_chord(walker->fabric, edge, &pair, &share))
		return false;
	strip_segment(walker, pair.face[0], pair.opposite[0], pair.opposite[1], width_mm, strip);
	return true;
}

void strip_add(struct strip *sum, const struct strip *part)
{
	sum->cost += part->cost;
	sum->area_mm2 += part->area_mm2;
	sum->covered_mm2 += part->covered_mm2;
	sum->largest = part->largest > sum->largest ? part->largest : sum->largest;
	sum->face_count += part->face_count;
}

double strip_cost(const struct strip *strip, int overhang)
{
	double missing = strip->area_mm2 - strip->covered_mm2;
	double charge = overhang != FIELD_OVERHANG_IGNORE && missing > 0 ? missing * strip->largest : 0;
	/* Areas that are 0 but for rounding may add up to less than nothing. */
	return strip->cost + charge < 0 ? 0 : strip->cost + charge;
}

bool strip_touches(const struct strip *strip)
{
	return strip->cost > NEGLIGIBLE_SHARE * strip->area_mm2;
}

double strip_coverage(const struct strip *strip)
{
	double share = strip->area_mm2 > 0 ? strip->covered_mm2 / strip->area_mm2 : 0;
	return share < 0 ? 0 : share < 1 ? share : 1;
}
