/* Meshes of cloth with a thickness: an outer and an inner side, a millimetre or so apart, facing away from each other.
 *
 * Some vertices, spread evenly over the mesh, look for a vertex that is near, lies along their normal and faces the
 * other way. On a single layer that happens where the suit folds onto itself; on two layers almost everywhere. */
#include "solver/garment/draft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 500 };
static const double thickest_mm = 5;

struct place {
	double x;
	uint32_t vertex;
};

static int compare_places(const void *a, const void *b)
{
	const struct place *p = a, *q = b;
	if (p->x != q->x)
		return p->x < q->x ? -1 : 1;
	return (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

/* Unit normals of the worn vertices, weighted by area; 0 where there is none. */
static void sum_normals(const struct garment *garment, double *normal)
{
	for (uint32_t f = 0; f < garment->face_count; f++) {
		const uint32_t *v = garment->face_vertex + 3 * (size_t)f;
		double u[3], w[3];
		for (size_t axis = 0; axis < 3; axis++) {
			u[axis] =
				garment->position[3 * (size_t)v[1] + axis] - garment->position[3 * (size_t)v[0] + axis];
			w[axis] =
				garment->position[3 * (size_t)v[2] + axis] - garment->position[3 * (size_t)v[0] + axis];
		}
		double cross[3] = {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]};
		for (size_t i = 0; i < 9; i++)
			normal[3 * (size_t)v[i / 3] + i % 3] += cross[i % 3];
	}
	for (uint32_t v = 0; v < garment->vertex_count; v++) {
		double *n = normal + 3 * (size_t)v, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		for (size_t axis = 0; axis < 3 && length > 0; axis++)
			n[axis] /= length;
	}
}

static bool is_other_side(const struct garment *garment, const double *normal, uint32_t v, uint32_t w)
{
	const double *n = normal + 3 * (size_t)v, *m = normal + 3 * (size_t)w;
	const double *p = garment->position + 3 * (size_t)v, *q = garment->position + 3 * (size_t)w;
	double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
	double distance = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
	double along = fabs(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]);
	double facing = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
	return distance > 0 && distance <= thickest_mm && along > 0.7 * distance && facing < -0.7;
}

/* Whether some vertex near places[i] is the other side of it. */
static bool has_other_side(const struct garment *garment, const double *normal, const struct place *places, uint32_t i,
			   uint64_t *budget)
{
	for (uint32_t j = i; j-- > 0 && places[i].x - places[j].x <= thickest_mm && *budget > 0; --*budget) {
		if (is_other_side(garment, normal, places[i].vertex, places[j].vertex))
			return true;
	}
	for (uint32_t j = i + 1; j < garment->vertex_count && places[j].x - places[i].x <= thickest_mm && *budget > 0;
	     j++, --*budget) {
		if (is_other_side(garment, normal, places[i].vertex, places[j].vertex))
			return true;
	}
	return false;
}

enum tw_status draft_check_thickness(struct draft *draft)
{
	const struct garment *garment = &draft->garment;
	struct arena_mark mark = arena_mark(draft->arena);
	double *normal = ARENA_ZEROED(draft->arena, 3 * (size_t)garment->vertex_count, double);
	struct place *places = ARENA_ARRAY(draft->arena, garment->vertex_count, struct place);
	if (!normal || !places)
		return tw_fail_memory(draft->error);
	sum_normals(garment, normal);
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		places[v] = (struct place){garment->position[3 * (size_t)v], v};
	qsort(places, garment->vertex_count, sizeof *places, compare_places);
	uint32_t samples = garment->vertex_count < SAMPLES ? garment->vertex_count : SAMPLES, doubled = 0;
	uint64_t budget = 50000000;
	for (uint32_t s = 0; s < samples; s++)
		doubled += has_other_side(garment, normal, places,
					  (uint32_t)((uint64_t)s * garment->vertex_count / samples), &budget);
	arena_release(draft->arena, mark);
	if (2 * doubled > samples)
		return tw_fail(
			draft->error, TW_ERROR_INPUT, "mesh-has-thickness", NULL,
			"the mesh has an outer and an inner side, %u of %u vertices lie opposite another within %g mm; "
			"export the fabric without thickness, as one layer",
			doubled, samples, thickest_mm);
	return TW_OK;
}
