/* Purpose: keep a set of edges a tree without bare ends. Everything costs time proportional to the edges given, not to
 * the instance: `has`, `degree` and `parent` are valid only where the tree is, and are wiped edge by edge. */
#include "solver/steiner/primal/tree.h"

#include "solver/steiner/union_find.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum tw_status primal_tree_init(struct primal_tree *tree, struct arena *arena, const struct instance *instance)
{
	const size_t n = instance->vertex_count, m = instance->edge_count;
	*tree = (struct primal_tree){
		.instance = instance,
		.edge = ARENA_ARRAY(arena, n, uint32_t),
		.has = ARENA_ZEROED(arena, m, uint8_t),
		.degree = ARENA_ZEROED(arena, n, uint32_t),
		.parent = ARENA_ARRAY(arena, n, uint32_t),
	};
	return tree->edge && tree->has && tree->degree && tree->parent ? TW_OK : TW_ERROR_MEMORY;
}

static void wipe(struct primal_tree *tree)
{
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		const uint32_t e = tree->edge[i];
		tree->has[e] = 0;
		tree->degree[tree->instance->ends[2 * e]] = 0;
		tree->degree[tree->instance->ends[2 * e + 1]] = 0;
	}
	tree->edge_count = 0;
}

/* Insertion order for equal weights, so that the order is the same everywhere: an edge has one place only. */
static int compare_by_weight(const void *a, const void *b, void *context)
{
	const struct instance *instance = context;
	const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	const fine_t p = instance->weight[x], q = instance->weight[y];
	if (p != q)
		return p < q ? -1 : 1;
	return (x > y) - (x < y);
}

static void span(struct primal_tree *tree, const uint32_t *edges, uint32_t edge_count)
{
	const struct instance *instance = tree->instance;
	uint32_t *parent = tree->parent;
	for (uint32_t i = 0; i < edge_count; i++)
		for (uint32_t side = 0; side < 2; side++) {
			const uint32_t v = instance->ends[2 * edges[i] + side];
			parent[v] = v;
		}
	for (uint32_t i = 0; i < edge_count; i++) {
		const uint32_t e = edges[i], u = instance->ends[2 * e], v = instance->ends[2 * e + 1];
		const uint32_t a = union_find(parent, u), b = union_find(parent, v);
		if (a == b)
			continue;
		parent[a] = b;
		assert(tree->edge_count < instance->vertex_count && !tree->has[e]);
		tree->edge[tree->edge_count++] = e;
		tree->has[e] = 1;
		tree->degree[u]++;
		tree->degree[v]++;
	}
}

/* The exclusive or of the edges at a vertex is its only edge when it has one; `parent` holds it. */
static void cut_bare_ends(struct primal_tree *tree)
{
	const struct instance *instance = tree->instance;
	uint32_t *link = tree->parent, kept = 0;
	for (uint32_t i = 0; i < tree->edge_count; i++)
		link[instance->ends[2 * tree->edge[i]]] = link[instance->ends[2 * tree->edge[i] + 1]] = 0;
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		link[instance->ends[2 * tree->edge[i]]] ^= tree->edge[i];
		link[instance->ends[2 * tree->edge[i] + 1]] ^= tree->edge[i];
	}
	for (uint32_t i = 0; i < 2 * tree->edge_count; i++) {
		uint32_t v = instance->ends[2 * tree->edge[i / 2] + i % 2];
		while (tree->degree[v] == 1 && instance->terminal_at[v] == INSTANCE_NONE) {
			const uint32_t e = link[v], u = instance->ends[2 * e] ^ instance->ends[2 * e + 1] ^ v;
			tree->has[e] = 0;
			tree->degree[v] = 0;
			tree->degree[u]--;
			link[u] ^= e;
			v = u;
		}
	}
	tree->weight = 0;
	for (uint32_t i = 0; i < tree->edge_count; i++)
		if (tree->has[tree->edge[i]]) {
			tree->weight += instance->weight[tree->edge[i]];
			tree->edge[kept++] = tree->edge[i];
		}
	tree->edge_count = kept;
}

void primal_tree_set(struct primal_tree *tree, uint32_t *edges, uint32_t edge_count, int sorted)
{
	wipe(tree);
	if (sorted)
		qsort_r(edges, edge_count, sizeof *edges, compare_by_weight, (void *)(uintptr_t)tree->instance);
	span(tree, edges, edge_count);
	cut_bare_ends(tree);
}
