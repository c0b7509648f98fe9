#include "solver/layout/ground.h"

#include "solver/layout/regions.h"

#include <math.h>
#include <stdlib.h>

static const uint8_t *take_marks(struct arena *arena, const uint8_t *asked, const uint32_t *from, uint32_t count)
{
	uint8_t *mark = ARENA_ARRAY(arena, count, uint8_t);
	for (uint32_t i = 0; mark && i < count; i++)
		mark[i] = asked[from[i]];
	return mark;
}

static enum tw_status take_constraints(struct ground *ground, struct arena *arena, struct tw_error *error)
{
	const struct layout_input *asked = ground->asked;
	const struct canonical *canonical = &ground->base->canonical;
	const uint32_t faces = asked->garment->face_count, edges = asked->topology->edge_count;
	struct field_constraints *found = &ground->found;
	if (!constraints_any(&asked->request->constraints))
		return TW_OK;
	enum tw_status status =
		constraints_find(found, arena, asked->garment, asked->topology, &asked->request->constraints, error);
	if (status != TW_OK)
		return status;
	const struct field_constraints in_file = *found;
	if (in_file.face_multiplier) {
		double *multiplier = ARENA_ARRAY(arena, faces, double);
		for (uint32_t f = 0; multiplier && f < faces; f++)
			multiplier[f] = in_file.face_multiplier[canonical->face[f]];
		found->face_multiplier = multiplier;
	}
	if (in_file.face_keep_out)
		found->face_keep_out = take_marks(arena, in_file.face_keep_out, canonical->face, faces);
	if (in_file.edge_free)
		found->edge_free = take_marks(arena, in_file.edge_free, canonical->edge, edges);
	if ((in_file.face_multiplier && !found->face_multiplier) || (in_file.face_keep_out && !found->face_keep_out) ||
	    (in_file.edge_free && !found->edge_free))
		return tw_fail_memory(error);
	ground->constraints = found;
	return TW_OK;
}

static enum tw_status find_base(struct ground *ground, struct arena *arena, struct tw_error *error)
{
	const struct layout_input *asked = ground->asked;
	ground->base = asked->base ? asked->base : &ground->own;
	if (asked->base)
		return TW_OK;
	return layout_base_build(&ground->own, arena, asked->garment, asked->topology, asked->field, error);
}

enum tw_status ground_build(struct ground *ground, struct arena *arena, const struct layout_input *asked,
			    struct tw_error *error)
{
	*ground = (struct ground){.asked = asked, .input = *asked};
	enum tw_status status = find_base(ground, arena, error);
	if (status == TW_OK)
		status = take_constraints(ground, arena, error);
	ground->input.garment = &ground->base->canonical.garment;
	ground->input.topology = &ground->base->canonical.topology;
	ground->input.field = &ground->base->field;
	return status;
}

/* A share in steps so small, and so round, that it comes out the same from whatever end or corner it was told. */
static double round_share(double share)
{
	return ldexp(nearbyint(ldexp(share, 40)), -40);
}

/* The site on one of the faces of its edge. */
static struct place place_on_edge(const struct ground *ground, const struct site *site, uint32_t which)
{
	const struct topology *topology = &ground->base->canonical.topology;
	uint32_t face = topology->edge_face[2 * (size_t)site->edge + which];
	uint32_t from = topology->edge_side[2 * (size_t)site->edge + which], to = from == 2 ? 0 : from + 1;
	bool forward = topology->edge_vertex[2 * (size_t)site->edge] ==
		       ground->base->canonical.garment.face_vertex[3 * (size_t)face + from];
	struct place place = {.face = face, .distance = site->place.distance};
	place.barycentric[from] = forward ? 1 - site->along : site->along;
	place.barycentric[to] = forward ? site->along : 1 - site->along;
	return place;
}

static void renumber_vertex(const struct ground *ground, const uint32_t *vertex_face, struct site *site)
{
	const struct canonical *canonical = &ground->base->canonical;
	site->vertex = canonical->vertex_of[site->vertex];
	site->place.face = vertex_face[site->vertex];
	for (uint32_t k = 0; k < 3; k++)
		site->place.barycentric[k] =
			canonical->garment.face_vertex[3 * (size_t)site->place.face + k] == site->vertex;
}

static void renumber_edge(const struct ground *ground, struct site *site)
{
	const struct canonical *canonical = &ground->base->canonical;
	uint32_t first = canonical->vertex_of[ground->asked->topology->edge_vertex[2 * (size_t)site->edge]];
	site->edge = canonical->edge_of[site->edge];
	site->along = round_share(site->along);
	if (canonical->topology.edge_vertex[2 * (size_t)site->edge] != first)
		site->along = 1 - site->along;
	site->place = place_on_edge(ground, site, 0);
	/* One mark is as good as two on the same piece; there are as many as before. */
	for (uint32_t i = 0; i < site->mark_count && i < 2; i++) {
		struct place place = place_on_edge(ground, site, i);
		site->mark[i] = (struct site_mark){canonical->garment.face_piece[place.face],
						   place_on_pattern(&canonical->garment, &place)};
	}
}

static void renumber_face(const struct ground *ground, struct site *site)
{
	const struct canonical *canonical = &ground->base->canonical;
	struct place place = {.face = canonical->face_of[site->place.face], .distance = site->place.distance};
	canonical_weights(canonical, place.face, site->place.barycentric, place.barycentric);
	for (uint32_t k = 0; k < 2; k++)
		place.barycentric[k] = round_share(place.barycentric[k]);
	place.barycentric[2] = 1 - place.barycentric[0] - place.barycentric[1];
	site->place = place;
	for (uint32_t i = 0; i < site->mark_count; i++)
		site->mark[i].at = place_on_pattern(&canonical->garment, &place);
}

static void renumber(const struct ground *ground, const uint32_t *vertex_face, struct site *site)
{
	switch (site->kind) {
	case SITE_VERTEX:
		renumber_vertex(ground, vertex_face, site);
		break;
	case SITE_EDGE:
		renumber_edge(ground, site);
		break;
	case SITE_FACE:
		renumber_face(ground, site);
		break;
	}
}

/* The mark of the site's place first, then by their places on the pattern. */
static void order_marks(const struct garment *garment, struct site *site)
{
	struct vec2 own = place_on_pattern(garment, &site->place);
	uint32_t piece = garment->face_piece[site->place.face];
	for (uint32_t i = 1; i < site->mark_count; i++)
		for (uint32_t j = i; j > 0; j--) {
			const struct site_mark *a = &site->mark[j - 1], *b = &site->mark[j];
			bool a_own = a->piece == piece && vec2_distance(a->at, own) < 1e-6;
			bool b_own = b->piece == piece && vec2_distance(b->at, own) < 1e-6;
			bool lower = b->at.x < a->at.x || (b->at.x == a->at.x && b->at.y < a->at.y);
			if (a_own || !(b_own || lower))
				break;
			struct site_mark swap = *a;
			site->mark[j - 1] = *b;
			site->mark[j] = swap;
		}
}

static int compare_numbers(double a, double b)
{
	return a < b ? -1 : a > b;
}

/* Where two lie, never which was named first: sites are distinct. */
static int compare_sites(const void *a, const void *b)
{
	const struct site *p = a, *q = b;
	if (p->kind != q->kind)
		return p->kind < q->kind ? -1 : 1;
	uint32_t at_p = p->kind == SITE_VERTEX ? p->vertex : p->kind == SITE_EDGE ? p->edge : p->place.face;
	uint32_t at_q = q->kind == SITE_VERTEX ? q->vertex : q->kind == SITE_EDGE ? q->edge : q->place.face;
	if (at_p != at_q)
		return at_p < at_q ? -1 : 1;
	for (int k = 0; k < 3; k++)
		if (p->place.barycentric[k] != q->place.barycentric[k])
			return compare_numbers(p->place.barycentric[k], q->place.barycentric[k]);
	return p->terminal < q->terminal ? -1 : p->terminal > q->terminal;
}

enum tw_status ground_take_sites(const struct ground *ground, struct arena *arena, struct site_set *sites,
				 struct tw_error *error)
{
	const struct garment *garment = &ground->base->canonical.garment;
	const uint32_t terminals = ground->asked->request->terminal_count;
	const struct arena_mark mark = arena_mark(arena);
	uint32_t *vertex_face = ARENA_ARRAY(arena, garment->vertex_count, uint32_t);
	uint32_t *first = ARENA_ARRAY(arena, terminals, uint32_t), *site_of = ARENA_ARRAY(arena, terminals, uint32_t);
	if (!vertex_face || !first || !site_of)
		return tw_fail_memory(error);
	for (uint32_t t = 0; t < terminals; t++)
		first[t] = sites->site[sites->site_of[t]].terminal;
	for (size_t corner = 3 * (size_t)garment->face_count; corner-- > 0;)
		vertex_face[garment->face_vertex[corner]] = (uint32_t)(corner / 3);
	for (uint32_t s = 0; s < sites->count; s++) {
		renumber(ground, vertex_face, &sites->site[s]);
		order_marks(garment, &sites->site[s]);
	}
	qsort(sites->site, sites->count, sizeof *sites->site, compare_sites);
	/* Every terminal goes where the first one at its place went. */
	for (uint32_t s = 0; s < sites->count; s++)
		site_of[sites->site[s].terminal] = s;
	for (uint32_t t = 0; t < terminals; t++)
		sites->site_of[t] = site_of[first[t]];
	arena_release(arena, mark);
	return TW_OK;
}

struct place ground_asked_place(const struct ground *ground, const struct place *place)
{
	struct place asked = *place;
	asked.face = ground->base->canonical.face[place->face];
	canonical_original_weights(&ground->base->canonical, place->face, place->barycentric, asked.barycentric);
	return asked;
}
