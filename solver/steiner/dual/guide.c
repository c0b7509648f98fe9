/* Purpose: hang the best tree from the root. */
#include "solver/steiner/dual/guide.h"

#include <assert.h>
#include <string.h>

enum tw_status dual_guide_allocate(struct dual_guide *guide, struct search *search)
{
	const size_t n = search->instance.vertex_count;
	*guide = (struct dual_guide){
		.first = ARENA_ZEROED(search->arena, n + 1, uint32_t),
		.next = ARENA_ARRAY(search->arena, 2 * n, uint32_t),
		.parent = ARENA_ARRAY(search->arena, n, uint32_t),
		.vertex = ARENA_ARRAY(search->arena, n, uint32_t),
	};
	return guide->first && guide->next && guide->parent && guide->vertex ? TW_OK : TW_ERROR_MEMORY;
}

static void forget(struct dual_guide *guide, const struct instance *instance)
{
	guide->count = 0;
	memset(guide->first, 0, ((size_t)instance->vertex_count + 1) * sizeof *guide->first);
}

/* The rows of the tree's vertices, which are empty elsewhere. */
static void fill_rows(struct dual_guide *guide, const struct instance *instance, const uint8_t *is_best)
{
	uint32_t count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		guide->first[v] = count;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++)
			if (is_best[instance->edge[a]])
				guide->next[count++] = instance->head[a];
	}
	assert(count <= 2 * instance->vertex_count);
	guide->first[instance->vertex_count] = count;
}

/* Lists the tree's vertices from the root on, each after its parent. False when the edges are no tree that spans the
 * terminals: deletion may have taken some of them, and reductions may have laid others together. */
static bool hang_from_root(struct dual_guide *guide, const struct instance *instance, uint32_t root,
			   uint32_t edge_count)
{
	uint32_t terminals = 0;
	memset(guide->parent, 0xff, instance->vertex_count * sizeof *guide->parent);
	guide->vertex[0] = root;
	guide->count = 1;
	for (uint32_t i = 0; i < guide->count; i++) {
		const uint32_t v = guide->vertex[i];
		terminals += instance->terminal_at[v] != INSTANCE_NONE;
		for (uint32_t j = guide->first[v]; j < guide->first[v + 1]; j++) {
			const uint32_t u = guide->next[j];
			if (u == root || guide->parent[u] != INSTANCE_NONE)
				continue;
			guide->parent[u] = v;
			guide->vertex[guide->count++] = u;
		}
	}
	return terminals == instance->terminal_count && guide->count == edge_count + 1;
}

enum tw_status dual_guide_set(struct dual_guide *guide, struct search *search, uint32_t root)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	forget(guide, instance);
	if (!search_uses(search, STEINER_GUIDE))
		return TW_OK;
	uint8_t *is_best = ARENA_ARRAY(search->arena, instance->edge_count, uint8_t);
	enum tw_status status = is_best ? search_mark_best(search, is_best) : TW_ERROR_MEMORY;
	uint32_t edges = 0;
	for (uint32_t e = 0; status == TW_OK && e < instance->edge_count; e++)
		edges += is_best[e];
	if (status == TW_OK && edges && edges < instance->vertex_count) {
		fill_rows(guide, instance, is_best);
		if (!hang_from_root(guide, instance, root, edges))
			forget(guide, instance);
	}
	arena_release(search->arena, mark);
	search->work += instance->edge_count / 4;
	return status;
}
