/* Every form becomes a face with barycentric weights; that is then recognised as a vertex, a point of an edge, or a
 * point inside the face, so that equal places compare equal however they were given. */
#include "solver/layout/terminals.h"

#include "solver/garment/correspondence.h"
#include "solver/names.h"

#include <stdbool.h>
#include <string.h>

/* Nearer than this is the same place, mm. */
static const double coincident = 1e-3;

struct placer {
	const struct garment *garment;
	const struct topology *topology;
	const struct locator *locator;
	const struct layout_request *request;
	double snap_mm;
	uint32_t *vertex_face; /* [vertex_count] a face of each vertex; GARMENT_NONE where it has none */
};

static enum tw_status fail_at(uint32_t terminal, const char *field, const char *type, struct tw_error *error,
			      const char *format, double value, double limit)
{
	char where[64];
	snprintf(where, sizeof where, "/terminals/%u%s", terminal, field);
	char text[256];
	snprintf(text, sizeof text, format, value, limit);
	return tw_fail(error, TW_ERROR_INPUT, type, where, "%s", text);
}

static const double *worn(const struct garment *garment, uint32_t face, uint32_t k)
{
	return &garment->position[3 * (size_t)garment->face_vertex[3 * (size_t)face + k]];
}

struct vec3 {
	double x, y, z;
};

static struct vec3 sub3(const double *a, const double *b)
{
	return (struct vec3){a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

static double dot3(struct vec3 a, struct vec3 b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* The weights of the point of a triangle that is nearest to p: Ericson, Real-Time Collision Detection (2005), 5.1.5,
 * which tells the seven regions of the plane apart by dot products. */
static void nearest_weights(const double *a, const double *b, const double *c, const double *p, double w[3])
{
	struct vec3 ab = sub3(b, a), ac = sub3(c, a), ap = sub3(p, a), bp = sub3(p, b), cp = sub3(p, c);
	double d1 = dot3(ab, ap), d2 = dot3(ac, ap), d3 = dot3(ab, bp), d4 = dot3(ac, bp), d5 = dot3(ab, cp),
	       d6 = dot3(ac, cp);
	double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
	double v, u;
	if (d1 <= 0 && d2 <= 0) {
		v = u = 0;
	} else if (d3 >= 0 && d4 <= d3) {
		v = 1, u = 0;
	} else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
		v = d1 / (d1 - d3), u = 0;
	} else if (d6 >= 0 && d5 <= d6) {
		v = 0, u = 1;
	} else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
		v = 0, u = d2 / (d2 - d6);
	} else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
		u = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - u;
	} else {
		double sum = va + vb + vc;
		v = vb / sum, u = vc / sum;
	}
	w[0] = 1 - v - u, w[1] = v, w[2] = u;
}

/* A lower bound of the squared distance from p to a face, from its bounding box. */
static double box_distance(const struct garment *garment, uint32_t face, const double *p)
{
	double square = 0;
	for (int i = 0; i < 3; i++) {
		double low = INFINITY, high = -INFINITY;
		for (uint32_t k = 0; k < 3; k++) {
			double x = worn(garment, face, k)[i];
			low = x < low ? x : low;
			high = x > high ? x : high;
		}
		double d = p[i] < low ? low - p[i] : p[i] > high ? p[i] - high : 0;
		square += d * d;
	}
	return square;
}

static void place_point(const struct garment *garment, const double *p, struct place *best)
{
	double least = INFINITY;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		if (box_distance(garment, f, p) >= least)
			continue;
		struct place place = {.face = f};
		nearest_weights(worn(garment, f, 0), worn(garment, f, 1), worn(garment, f, 2), p, place.barycentric);
		double q[3];
		place_on_worn(garment, &place, q);
		struct vec3 d = sub3(p, q);
		if (dot3(d, d) >= least)
			continue;
		least = dot3(d, d);
		*best = place;
	}
	best->distance = sqrt(least);
}

static enum tw_status place_in_piece(const struct placer *placer, uint32_t index, struct place *place,
				     struct tw_error *error)
{
	const struct layout_terminal *terminal = &placer->request->terminals[index];
	uint32_t piece = 0;
	while (piece < placer->garment->piece_count && strcmp(placer->garment->piece_name[piece], terminal->piece) != 0)
		piece++;
	if (piece == placer->garment->piece_count) {
		char where[64];
		snprintf(where, sizeof where, "/terminals/%u/piece", index);
		const struct names names = {(const char *const *)placer->garment->piece_name,
					    placer->garment->piece_count};
		return names_refuse(&names, "pattern piece", terminal->piece, "terminal-unknown-piece", where, error);
	}
	locator_find(placer->locator, piece, (struct vec2){terminal->uv_mm[0], terminal->uv_mm[1]}, place);
	if (place->distance > placer->snap_mm)
		return fail_at(index, "/uv_mm", "terminal-off-fabric", error,
			       "the point is %.2f mm off the piece, more than %.4g mm", place->distance,
			       placer->snap_mm);
	return TW_OK;
}

static enum tw_status place_at_vertex(const struct placer *placer, uint32_t index, struct place *place,
				      struct tw_error *error)
{
	uint32_t file_vertex = placer->request->terminals[index].vertex;
	if (file_vertex >= garment_source_count(placer->garment))
		return fail_at(index, "/vertex", "terminal-out-of-range", error,
			       "there is no vertex %.0f: the garment's file has %.0f vertices, counted from 0",
			       file_vertex, garment_source_count(placer->garment));
	uint32_t vertex = garment_mesh_vertex(placer->garment, file_vertex), face = placer->vertex_face[vertex];
	if (face == GARMENT_NONE)
		return fail_at(index, "/vertex", "terminal-off-fabric", error,
			       "vertex %.0f belongs to no face, so no wire can reach it", file_vertex, 0);
	*place = (struct place){.face = face};
	for (uint32_t k = 0; k < 3; k++)
		place->barycentric[k] = placer->garment->face_vertex[3 * (size_t)face + k] == vertex;
	return TW_OK;
}

static enum tw_status place_in_face(const struct placer *placer, uint32_t index, struct place *place,
				    struct tw_error *error)
{
	const struct layout_terminal *terminal = &placer->request->terminals[index];
	*place = (struct place){.face = GARMENT_NONE};
	if (terminal->face >= garment_file_faces(placer->garment))
		return fail_at(index, "/face", "terminal-out-of-range", error,
			       "there is no face %.0f: the garment's file has %.0f faces, counted from 0",
			       terminal->face, garment_file_faces(placer->garment));
	if (!garment_place_from_file(placer->garment, terminal->face, terminal->barycentric, &place->face,
				     place->barycentric))
		return fail_at(index, "/face", "terminal-in-polygon", error,
			       "face %.0f has more than three corners in the file, so that three weights name no point "
			       "of it; give a vertex, point_mm, or piece and uv_mm",
			       terminal->face, 0);
	return TW_OK;
}

static enum tw_status find_place(const struct placer *placer, uint32_t index, struct place *place,
				 struct tw_error *error)
{
	const struct layout_terminal *terminal = &placer->request->terminals[index];
	switch (terminal->kind) {
	case TERMINAL_VERTEX:
		return place_at_vertex(placer, index, place, error);
	case TERMINAL_FACE:
		return place_in_face(placer, index, place, error);
	case TERMINAL_POINT:
		place_point(placer->garment, terminal->point_mm, place);
		if (place->distance > placer->snap_mm)
			return fail_at(index, "/point_mm", "terminal-off-fabric", error,
				       "the point is %.2f mm away from the fabric, more than %.4g mm", place->distance,
				       placer->snap_mm);
		return TW_OK;
	case TERMINAL_PATTERN:
		return place_in_piece(placer, index, place, error);
	}
	return TW_OK;
}

/* Height of corner k above the opposite side, in the pattern. */
static double height_of(const struct garment *garment, uint32_t face, uint32_t k)
{
	struct vec2 corner[3];
	for (uint32_t i = 0; i < 3; i++) {
		const double *uv = &garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)face + i]];
		corner[i] = (struct vec2){uv[0], uv[1]};
	}
	struct vec2 base = vec2_sub(corner[(k + 2) % 3], corner[(k + 1) % 3]);
	return fabs(vec2_cross(base, vec2_sub(corner[k], corner[(k + 1) % 3]))) / vec2_length(base);
}

/* Vertex, edge or inside. A weight times the height of its corner is the distance from the opposite side. */
static void recognise(const struct placer *placer, struct site *site)
{
	struct place *place = &site->place;
	bool zero[3];
	uint32_t zeros = 0, largest = 0;
	for (uint32_t k = 0; k < 3; k++) {
		zero[k] = place->barycentric[k] * height_of(placer->garment, place->face, k) < coincident;
		zeros += zero[k];
		largest = place->barycentric[k] > place->barycentric[largest] ? k : largest;
	}
	site->kind = zeros >= 2 ? SITE_VERTEX : zeros == 1 ? SITE_EDGE : SITE_FACE;
	const uint32_t *corner = &placer->garment->face_vertex[3 * (size_t)place->face];
	if (site->kind == SITE_VERTEX) {
		site->vertex = corner[largest];
		for (uint32_t k = 0; k < 3; k++)
			place->barycentric[k] = k == largest;
	} else if (site->kind == SITE_EDGE) {
		uint32_t off = zero[0] ? 0 : zero[1] ? 1 : 2, from = (off + 1) % 3, to = (off + 2) % 3;
		site->edge = placer->topology->face_edge[3 * (size_t)place->face + from];
		double share = place->barycentric[to] / (place->barycentric[from] + place->barycentric[to]);
		place->barycentric[off] = 0;
		place->barycentric[from] = 1 - share;
		place->barycentric[to] = share;
		bool forward = placer->topology->edge_vertex[2 * (size_t)site->edge] == corner[from];
		site->along = forward ? share : 1 - share;
	}
}

static bool same_site(const struct garment *garment, const struct site *a, const struct site *b)
{
	if (a->kind != b->kind)
		return false;
	if (a->kind == SITE_VERTEX)
		return a->vertex == b->vertex;
	if (a->kind == SITE_EDGE ? a->edge != b->edge : a->place.face != b->place.face)
		return false;
	double p[3], q[3];
	place_on_worn(garment, &a->place, p);
	place_on_worn(garment, &b->place, q);
	struct vec3 d = sub3(p, q);
	return dot3(d, d) < coincident * coincident;
}

static void merge(struct site_set *set, const struct garment *garment, const struct site *site, uint32_t terminal)
{
	for (uint32_t s = 0; s < set->count; s++) {
		if (same_site(garment, &set->site[s], site)) {
			set->site[s].merged_count++;
			set->site_of[terminal] = s;
			return;
		}
	}
	set->site_of[terminal] = set->count;
	set->site[set->count++] = *site;
}

/* Where sites lie on the pattern: those at a vertex or on a seam in more than one place. */
struct marker {
	const struct garment *garment;
	const struct topology *topology;
	struct site_set *set;
	uint32_t *first; /* [vertex_count] the first site at each vertex, or on an edge whose lower end it is */
	uint32_t *next;  /* [set->count] */
};

/* The site as a place of `face`; false where it does not lie there. */
static bool place_on_face(const struct marker *marker, const struct site *site, uint32_t face, struct place *place)
{
	const uint32_t *corner = &marker->garment->face_vertex[3 * (size_t)face];
	*place = (struct place){.face = face};
	for (uint32_t k = 0; k < 3; k++) {
		if (site->kind == SITE_VERTEX) {
			place->barycentric[k] = corner[k] == site->vertex;
		} else if (marker->topology->face_edge[3 * (size_t)face + k] == site->edge) {
			bool forward = marker->topology->edge_vertex[2 * (size_t)site->edge] == corner[k];
			place->barycentric[k] = forward ? 1 - site->along : site->along;
			place->barycentric[(k + 1) % 3] = forward ? site->along : 1 - site->along;
			return true;
		}
	}
	return site->kind == SITE_VERTEX;
}

/* Two faces of an edge give the same point but for rounding. */
static void add_mark(const struct garment *garment, struct site *site, const struct place *place)
{
	uint32_t piece = garment->face_piece[place->face];
	struct vec2 at = place_on_pattern(garment, place);
	for (uint32_t i = 0; i < site->mark_count; i++) {
		if (site->mark[i].piece == piece && vec2_distance(site->mark[i].at, at) < coincident)
			return;
	}
	site->mark[site->mark_count++] = (struct site_mark){piece, at};
}

/* Every site of every face that has it: counts faces into mark_count, or (`fill`) adds their marks. */
static void visit_faces(const struct marker *marker, bool fill)
{
	for (size_t corner = 0; corner < 3 * (size_t)marker->garment->face_count; corner++) {
		uint32_t vertex = marker->garment->face_vertex[corner];
		for (uint32_t s = marker->first[vertex]; s != GARMENT_NONE; s = marker->next[s]) {
			struct site *site = &marker->set->site[s];
			struct place place;
			if (!fill)
				site->mark_count++;
			else if (place_on_face(marker, site, (uint32_t)(corner / 3), &place))
				add_mark(marker->garment, site, &place);
		}
	}
}

static enum tw_status mark_sites(struct site_set *set, struct arena *arena, const struct garment *garment,
				 const struct topology *topology, struct tw_error *error)
{
	struct marker marker = {garment, topology, set, ARENA_ARRAY(arena, garment->vertex_count, uint32_t),
				ARENA_ARRAY(arena, set->count, uint32_t)};
	if (!marker.first || !marker.next)
		return tw_fail_memory(error);
	memset(marker.first, 0xff, garment->vertex_count * sizeof *marker.first);
	for (uint32_t s = 0; s < set->count; s++) {
		const struct site *site = &set->site[s];
		if (site->kind == SITE_FACE)
			continue;
		uint32_t vertex =
			site->kind == SITE_VERTEX ? site->vertex : topology->edge_vertex[2 * (size_t)site->edge];
		marker.next[s] = marker.first[vertex];
		marker.first[vertex] = s;
	}
	visit_faces(&marker, false);
	for (uint32_t s = 0; s < set->count; s++) {
		struct site *site = &set->site[s];
		site->mark = ARENA_ARRAY(arena, (size_t)site->mark_count + 1, struct site_mark);
		if (!site->mark)
			return tw_fail_memory(error);
		site->mark_count = 0;
		add_mark(garment, site, &site->place);
	}
	visit_faces(&marker, true);
	return TW_OK;
}

static enum tw_status check_components(const struct placer *placer, const struct site_set *set, struct tw_error *error)
{
	const uint32_t *corner = placer->garment->face_vertex, *component = placer->topology->vertex_component;
	for (uint32_t s = 1; s < set->count; s++) {
		uint32_t a = component[corner[3 * (size_t)set->site[0].place.face]];
		uint32_t b = component[corner[3 * (size_t)set->site[s].place.face]];
		if (a != b)
			return fail_at(set->site[s].terminal, "", "terminals-apart", error,
				       "no fabric joins this terminal with terminal %.0f: the garment falls into %.0f "
				       "parts that are not sewn together",
				       set->site[0].terminal, placer->topology->component_count);
	}
	return TW_OK;
}

enum tw_status terminals_place(struct site_set *set, struct arena *arena, const struct garment *garment,
			       const struct topology *topology, const struct locator *locator,
			       const struct layout_request *request, double snap_mm, struct tw_error *error)
{
	struct placer placer = {garment, topology, locator, request, snap_mm, NULL};
	*set = (struct site_set){0};
	set->site = ARENA_ARRAY(arena, request->terminal_count, struct site);
	set->site_of = ARENA_ARRAY(arena, request->terminal_count, uint32_t);
	set->snapped_mm = ARENA_ARRAY(arena, request->terminal_count, double);
	placer.vertex_face = ARENA_ARRAY(arena, garment->vertex_count, uint32_t);
	if (!set->site || !set->site_of || !set->snapped_mm || !placer.vertex_face)
		return tw_fail_memory(error);
	memset(placer.vertex_face, 0xff, garment->vertex_count * sizeof *placer.vertex_face);
	for (uint32_t f = garment->face_count; f-- > 0;)
		for (uint32_t k = 0; k < 3; k++)
			placer.vertex_face[garment->face_vertex[3 * (size_t)f + k]] = f;
	for (uint32_t i = 0; i < request->terminal_count; i++) {
		struct site site = {.terminal = i};
		enum tw_status status = find_place(&placer, i, &site.place, error);
		if (status != TW_OK)
			return status;
		set->snapped_mm[i] = site.place.distance;
		recognise(&placer, &site);
		merge(set, garment, &site, i);
	}
	enum tw_status status = check_components(&placer, set, error);
	return status == TW_OK ? mark_sites(set, arena, garment, topology, error) : status;
}
