/* The net's edges are springs of their rest length. In each round every vertex moves to the mean of the places where
 * its springs would have it: freely along the skin (the tangent plane of the posed net), inwards as far as flesh gives
 * way, never outwards; hems stay. A fixed number of rounds lets a stretch spread over some eight edges, as far as
 * friction would allow. A carried vertex takes the mean of the net vertices around it on its side of the body, weighted
 * by a smooth bell. */
#include "solver/sample/slide.h"

#include "solver/sample/half.h"

#include <stdlib.h>
#include <string.h>

enum { NET_VERTICES = 2600, ROUNDS = 70, BELL_COUNT = 16 };

/* mm */
static const double bell_radius = 56;

/* Flesh gives way to tight cloth: the share of an inward wish that it grants, and the share of the depth that it takes
 * back in a round. It never lets the cloth off. */
static const double flesh_softness = 1, flesh_return = 0.012;

struct spring {
	uint32_t end[2];
	double length;
};

struct bell {
	uint16_t vertex[BELL_COUNT];
	float weight[BELL_COUNT]; /* sums to 1; 0 where unused */
};

struct slide {
	uint32_t count; /* of the net */
	struct vec3 *rest;
	uint8_t *fixed; /* [count] at a hem */
	double *share;  /* [count] of a vertex in the sum of its springs' wishes */
	uint32_t face_count, spring_count;
	uint32_t (*corner)[3];
	struct spring *spring;
	struct bell *bell;                          /* [carried vertex] */
	struct vec3 *place, *normal, *wish, *shift; /* [count] of the last frame */
};

static bool room(struct slide *slide, struct arena *arena, const struct half *half)
{
	uint32_t count = slide->count = half_whole_count(half);
	slide->face_count = 2 * half->surface.face_count;
	slide->rest = ARENA_ARRAY(arena, count, struct vec3);
	slide->fixed = ARENA_ZEROED(arena, count, uint8_t);
	slide->share = ARENA_ZEROED(arena, count, double);
	slide->corner = arena_array(arena, slide->face_count, sizeof *slide->corner);
	slide->spring = ARENA_ARRAY(arena, 3 * (size_t)slide->face_count, struct spring);
	slide->place = ARENA_ARRAY(arena, count, struct vec3);
	slide->normal = ARENA_ARRAY(arena, count, struct vec3);
	slide->wish = ARENA_ARRAY(arena, count, struct vec3);
	slide->shift = ARENA_ZEROED(arena, count, struct vec3);
	return slide->rest && slide->fixed && slide->share && slide->corner && slide->spring && slide->place &&
	       slide->normal && slide->wish && slide->shift;
}

/* Both halves as one net. */
static bool unfold(struct slide *slide, struct arena *arena, const struct half *half, struct vec3 scale)
{
	const struct surface *surface = &half->surface;
	uint32_t *mirror = ARENA_ARRAY(arena, surface->vertex_count, uint32_t), image = surface->vertex_count;
	if (!mirror)
		return false;
	for (uint32_t v = 0; v < surface->vertex_count; v++) {
		struct vec3 p = surface->position[v];
		p = (struct vec3){p.x * scale.x, p.y * scale.y, p.z * scale.z};
		mirror[v] = surface->cuts[v] >> CUT_CENTRE & 1 ? v : image++;
		slide->rest[mirror[v]] = (struct vec3){-p.x, p.y, p.z};
		slide->rest[v] = p;
		bool hem = surface->cuts[v] & (1u << CUT_NECK | 1u << CUT_WRIST | 1u << CUT_ANKLE);
		slide->fixed[v] = slide->fixed[mirror[v]] = hem;
	}
	for (uint32_t f = 0; f < surface->face_count; f++) {
		const uint32_t *c = surface->corner[f];
		memcpy(slide->corner[2 * (size_t)f], c, sizeof *slide->corner);
		memcpy(slide->corner[2 * (size_t)f + 1], (uint32_t[3]){mirror[c[0]], mirror[c[2]], mirror[c[1]]},
		       sizeof *slide->corner);
	}
	return true;
}

/* Every edge is a spring; an inner one is met from both sides and taken from one. */
static void springs_make(struct slide *slide)
{
	for (uint32_t f = 0; f < slide->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = slide->corner[f][k], b = slide->corner[f][corner_next(k)];
			if (a > b && !(slide->fixed[a] && slide->fixed[b]))
				continue;
			double length = sqrt(vec3_apart(slide->rest[a], slide->rest[b]));
			slide->spring[slide->spring_count++] = (struct spring){{a, b}, length};
			slide->share[a] += 1;
			slide->share[b] += 1;
		}
	for (uint32_t v = 0; v < slide->count; v++)
		slide->share[v] = slide->fixed[v] || slide->share[v] == 0 ? 0 : 1 / slide->share[v];
}

/* A net vertex by height, to find those around a place. */
struct level {
	double height;
	uint32_t vertex;
};

static int level_compare(const void *left, const void *right)
{
	const struct level *a = left, *b = right;
	if (a->height != b->height)
		return a->height < b->height ? -1 : 1;
	return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

static uint32_t first_above(const struct level *level, uint32_t count, double height)
{
	uint32_t low = 0, high = count;
	while (low < high) {
		uint32_t middle = low + (high - low) / 2;
		if (level[middle].height < height)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

/* Adds a candidate, dropping the weakest when full. */
static void bell_add(struct bell *bell, uint32_t vertex, double weight)
{
	int weakest = 0;
	for (int i = 1; i < BELL_COUNT; i++)
		weakest = bell->weight[i] < bell->weight[weakest] ? i : weakest;
	if (weight <= (double)bell->weight[weakest])
		return;
	bell->weight[weakest] = (float)weight;
	bell->vertex[weakest] = (uint16_t)vertex;
}

static void bell_make(struct bell *bell, const struct slide *slide, const struct level *level, struct vec3 p,
		      struct vec3 normal)
{
	memset(bell, 0, sizeof *bell);
	double sum = 0;
	for (uint32_t i = first_above(level, slide->count, p.y - bell_radius);
	     i < slide->count && level[i].height < p.y + bell_radius; i++) {
		uint32_t v = level[i].vertex;
		double rest = 1 - vec3_apart(p, slide->rest[v]) / (bell_radius * bell_radius);
		double facing = 0.75 + vec3_dot(normal, slide->normal[v]); /* not the other leg */
		if (rest > 0 && facing > 0)
			bell_add(bell, v, rest * rest * rest * facing * facing);
	}
	for (int i = 0; i < BELL_COUNT; i++)
		sum += (double)bell->weight[i];
	for (int i = 0; i < BELL_COUNT && sum > 0; i++)
		bell->weight[i] = (float)((double)bell->weight[i] / sum);
}

/* Normals of the body in rest, in size L: the sizes differ too little to matter here. */
static struct vec3 rest_normal(const struct body *body, struct vec3 scale, struct vec3 p)
{
	struct vec3 n = body_normal(body, (struct vec3){fabs(p.x) / scale.x, p.y / scale.y, p.z / scale.z});
	return (struct vec3){p.x < 0 ? -n.x : n.x, n.y, n.z};
}

static bool bells_make(struct slide *slide, struct arena *scratch, const struct body *body, struct vec3 scale,
		       const double *rest, uint32_t count)
{
	struct level *level = ARENA_ARRAY(scratch, slide->count, struct level);
	if (!level)
		return false;
	for (uint32_t v = 0; v < slide->count; v++) {
		level[v] = (struct level){slide->rest[v].y, v};
		slide->normal[v] = rest_normal(body, scale, slide->rest[v]);
	}
	qsort(level, slide->count, sizeof *level, level_compare);
	for (uint32_t v = 0; v < count; v++) {
		struct vec3 p = {rest[3 * (size_t)v], rest[3 * (size_t)v + 1], rest[3 * (size_t)v + 2]};
		bell_make(&slide->bell[v], slide, level, p, rest_normal(body, scale, p));
	}
	return true;
}

bool slide_build(struct slide **slide, struct arena *arena, const struct body *body, struct vec3 scale,
		 const double *rest, uint32_t count)
{
	struct half half = {0};
	struct arena *scratch = arena_new(0);
	struct slide *made = *slide = ARENA_ZEROED(arena, 1, struct slide);
	bool done = scratch && made && half_mesh(&half, scratch, body, NET_VERTICES, 0) && room(made, arena, &half) &&
		    unfold(made, scratch, &half, scale);
	if (done) {
		springs_make(made);
		made->bell = ARENA_ARRAY(arena, count, struct bell);
		done = made->bell && bells_make(made, scratch, body, scale, rest, count);
	}
	arena_free(scratch);
	return done;
}

const struct vec3 *slide_rest(const struct slide *slide, uint32_t *count)
{
	*count = slide->count;
	return slide->rest;
}

static void normals_make(struct slide *slide)
{
	memset(slide->normal, 0, slide->count * sizeof *slide->normal);
	for (uint32_t f = 0; f < slide->face_count; f++) {
		const uint32_t *c = slide->corner[f];
		struct vec3 n = vec3_normal(slide->place[c[0]], slide->place[c[1]], slide->place[c[2]]);
		for (int k = 0; k < 3; k++)
			slide->normal[c[k]] = vec3_add(slide->normal[c[k]], n);
	}
	for (uint32_t v = 0; v < slide->count; v++)
		slide->normal[v] = vec3_unit(slide->normal[v]);
}

static void relax_once(struct slide *slide, const struct vec3 *posed)
{
	memset(slide->wish, 0, slide->count * sizeof *slide->wish);
	for (uint32_t i = 0; i < slide->spring_count; i++) {
		const struct spring *s = &slide->spring[i];
		struct vec3 along = vec3_sub(slide->place[s->end[1]], slide->place[s->end[0]]);
		double length = vec3_length(along);
		along = vec3_scale(along, (length - s->length) / (length + 1e-9));
		slide->wish[s->end[0]] = vec3_add(slide->wish[s->end[0]], along);
		slide->wish[s->end[1]] = vec3_sub(slide->wish[s->end[1]], along);
	}
	for (uint32_t v = 0; v < slide->count; v++) {
		struct vec3 n = slide->normal[v], move = vec3_scale(slide->wish[v], slide->share[v]);
		double outward = vec3_dot(move, n), depth = vec3_dot(vec3_sub(posed[v], slide->place[v]), n);
		double deeper = (1 - flesh_return) * depth - flesh_softness * outward;
		deeper = deeper > 0 ? deeper : 0;
		slide->place[v] = vec3_step(vec3_add(slide->place[v], move), n, depth - deeper - outward);
	}
}

void slide_relax(struct slide *slide, const struct vec3 *posed)
{
	memcpy(slide->place, posed, slide->count * sizeof *posed);
	normals_make(slide);
	for (int round = 0; round < ROUNDS; round++)
		relax_once(slide, posed);
	for (uint32_t v = 0; v < slide->count; v++)
		slide->shift[v] = vec3_sub(slide->place[v], posed[v]);
}

struct vec3 slide_shift(const struct slide *slide, uint32_t v)
{
	const struct bell *bell = &slide->bell[v];
	struct vec3 sum = {0, 0, 0};
	for (int i = 0; i < BELL_COUNT; i++)
		sum = vec3_step(sum, slide->shift[bell->vertex[i]], (double)bell->weight[i]);
	return sum;
}
