/* Sewn vertices that an export has doubled: each copy lies on a hem of its own piece. Hem vertices are sorted by x and
 * compared within the tolerance; those that are close, directly or through others, become the lowest of them. */
#include "solver/garment/correspondence.h"
#include "solver/garment/draft.h"

#include <stdlib.h>
#include <string.h>

struct hem_vertex {
	double position[3];
	uint32_t vertex;
};

static int compare_hem(const void *a, const void *b)
{
	const struct hem_vertex *x = a, *y = b;
	for (int axis = 0; axis < 3; axis++) {
		if (x->position[axis] != y->position[axis])
			return x->position[axis] < y->position[axis] ? -1 : 1;
	}
	return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

static uint32_t find_root(uint32_t *parent, uint32_t v)
{
	while (parent[v] != v) {
		parent[v] = parent[parent[v]];
		v = parent[v];
	}
	return v;
}

static bool is_close(const struct hem_vertex *a, const struct hem_vertex *b, double tolerance)
{
	double square = 0;
	for (int axis = 0; axis < 3; axis++)
		square += (a->position[axis] - b->position[axis]) * (a->position[axis] - b->position[axis]);
	return square <= tolerance * tolerance;
}

static uint32_t collect_hem(const struct draft *draft, struct hem_vertex *hem, uint32_t *marked)
{
	const struct topology *topology = &draft->topology;
	uint32_t count = 0;
	memset(marked, 0, draft->garment.vertex_count * sizeof *marked);
	for (size_t i = 0; i < 2 * (size_t)topology->edge_count; i++) {
		uint32_t v = topology->edge_vertex[i];
		if (topology->edge_kind[i / 2] != EDGE_HEM || marked[v])
			continue;
		marked[v] = 1;
		memcpy(hem[count].position, draft->garment.position + 3 * (size_t)v, sizeof hem[count].position);
		hem[count++].vertex = v;
	}
	qsort(hem, count, sizeof *hem, compare_hem);
	return count;
}

/* Sets parent[] to a forest whose roots are the lowest vertices; counts the vertices that are no root. */
static enum tw_status join(const struct draft *draft, double tolerance, uint32_t *parent, struct hem_vertex *hem,
			   uint32_t *joined)
{
	uint32_t count = collect_hem(draft, hem, parent);
	for (uint32_t v = 0; v < draft->garment.vertex_count; v++)
		parent[v] = v;
	uint64_t budget = 1000000 + 1000 * (uint64_t)count;
	*joined = 0;
	for (uint32_t i = 0; i < count; i++) {
		for (uint32_t j = i + 1; j < count && hem[j].position[0] - hem[i].position[0] <= tolerance; j++) {
			if (budget-- == 0)
				return tw_fail(
					draft->error, TW_ERROR_LIMIT, "weld-too-dense", NULL,
					"too many hem vertices lie within weld_mm of each other; use a smaller one");
			if (!is_close(&hem[i], &hem[j], tolerance))
				continue;
			uint32_t a = find_root(parent, hem[i].vertex), b = find_root(parent, hem[j].vertex);
			*joined += a != b;
			parent[a < b ? b : a] = a < b ? a : b;
		}
	}
	return TW_OK;
}

/* Renumbers the vertices without gaps, in their order. `parent` becomes the map from old to new. */
static enum tw_status renumber(struct draft *draft, uint32_t *parent)
{
	struct garment *garment = &draft->garment;
	garment->source_vertex = ARENA_ARRAY(draft->arena, 3 * (size_t)garment->vertex_count, uint32_t);
	garment->source_share = ARENA_ZEROED(draft->arena, 3 * (size_t)garment->vertex_count, double);
	if (!garment->source_vertex || !garment->source_share)
		return tw_fail_memory(draft->error);
	uint32_t kept = 0;
	for (uint32_t v = 0; v < garment->vertex_count; v++) {
		parent[v] = find_root(parent, v);
		if (parent[v] != v)
			continue;
		memmove(garment->position + 3 * (size_t)kept, garment->position + 3 * (size_t)v, 3 * sizeof(double));
		for (size_t k = 0; k < 3; k++)
			garment->source_vertex[3 * (size_t)kept + k] = v;
		garment->source_share[3 * (size_t)kept] = 1;
		kept++;
	}
	/* Roots are lower than the rest, so a root's new number stands before anybody asks for it. */
	uint32_t next = 0;
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		parent[v] = parent[v] == v ? next++ : parent[parent[v]];
	garment->mesh_vertex = parent;
	garment->vertex_count = kept;
	for (size_t i = 0; i < 3 * (size_t)garment->face_count; i++)
		garment->face_vertex[i] = parent[garment->face_vertex[i]];
	return TW_OK;
}

static enum tw_status check_collapse(const struct draft *draft)
{
	for (uint32_t f = 0; f < draft->garment.face_count; f++) {
		const uint32_t *v = draft->garment.face_vertex + 3 * (size_t)f;
		if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
			return fail_at_face(draft, f, "weld-collapses-face",
					    "welding joins two vertices of face %u; use a smaller weld_mm",
					    garment_file_face(&draft->garment, f));
	}
	return TW_OK;
}

static enum tw_status weld(struct draft *draft, uint32_t *parent)
{
	for (uint32_t v = 0; v < draft->garment.vertex_count; v++) {
		if (parent[v] != v)
			warning_add(&draft->report->warnings, "vertices-welded", "vertex", v,
				    "hem vertices at the place of another were sewn to it; frames of motions keep the "
				    "file's vertices");
	}
	enum tw_status status = renumber(draft, parent);
	if (status == TW_OK)
		status = check_collapse(draft);
	return status == TW_OK ? draft_connect(draft) : status;
}

enum tw_status draft_weld(struct draft *draft, double weld_mm)
{
	if (weld_mm == 0)
		return TW_OK;
	uint32_t *parent = ARENA_ARRAY(draft->arena, draft->garment.vertex_count, uint32_t);
	struct hem_vertex *hem = ARENA_ARRAY(draft->arena, draft->garment.vertex_count, struct hem_vertex);
	if (!parent || !hem)
		return tw_fail_memory(draft->error);
	uint32_t joined = 0;
	enum tw_status status = join(draft, weld_mm, parent, hem, &joined);
	return status == TW_OK && joined > 0 ? weld(draft, parent) : status;
}
