/* Builds compressed rows by counting: one pass counts each vertex's arcs, a running sum places the rows, a second pass
 * over the edges in order fills them, so that every row stands in the order of its edges. */
#include "solver/graph/graph.h"

#include <string.h>

static const uint64_t weight_total_max = (UINT64_C(1) << 62) - 1;

static enum tw_status check_edges(uint32_t vertex_count, uint32_t edge_count, const uint32_t *ends,
				  const uint64_t *weight, struct tw_error *error)
{
	uint64_t total = 0;
	for (uint32_t e = 0; e < edge_count; e++) {
		const uint32_t u = ends[2 * (size_t)e], v = ends[2 * (size_t)e + 1];
		char where[32];
		snprintf(where, sizeof where, "edge %u", e);
		if (u >= vertex_count || v >= vertex_count)
			return tw_fail(error, TW_ERROR_INPUT, "graph-edge-range", where,
				       "the edge joins %u and %u, but the graph has vertices 0 to %lld", u, v,
				       (long long)vertex_count - 1);
		if (u == v)
			return tw_fail(error, TW_ERROR_INPUT, "graph-loop", where,
				       "the edge is a loop at vertex %u; remove it", u);
		if (weight[e] > weight_total_max - total)
			return tw_fail(error, TW_ERROR_INPUT, "graph-weight-total", where,
				       "the weights sum to more than 62 bits hold; scale them down");
		total += weight[e];
	}
	return TW_OK;
}

static void fill_rows(struct graph *graph)
{
	const size_t n = graph->vertex_count;
	const size_t arc_count = 2 * (size_t)graph->edge_count;
	uint32_t *const first = graph->first;
	/* first[v + 1] counts, then becomes the start of v, then the write position of v, and so ends as the end of v.
	 */
	memset(first, 0, (n + 1) * sizeof *first);
	for (size_t i = 0; i < arc_count; i++)
		first[graph->ends[i] + 1]++;
	uint32_t start = 0;
	for (size_t v = 1; v <= n; v++) {
		const uint32_t degree = first[v];
		first[v] = start;
		start += degree;
	}
	for (size_t i = 0; i < arc_count; i++) {
		const uint32_t slot = first[graph->ends[i] + 1]++;
		graph->head[slot] = graph->ends[i ^ 1];
		graph->edge[slot] = (uint32_t)(i / 2);
	}
}

enum tw_status graph_build(struct graph *graph, struct arena *arena, uint32_t vertex_count, uint32_t edge_count,
			   const uint32_t *ends, const uint64_t *weight, struct tw_error *error)
{
	*graph = (struct graph){0};
	if (vertex_count == GRAPH_NONE || edge_count > UINT32_MAX / 2)
		return tw_fail(error, TW_ERROR_INPUT, "graph-too-large", NULL,
			       "a graph holds at most %u vertices and %u edges", UINT32_MAX - 1, UINT32_MAX / 2);
	const enum tw_status status = check_edges(vertex_count, edge_count, ends, weight, error);
	if (status != TW_OK)
		return status;

	const size_t arc_count = 2 * (size_t)edge_count;
	const struct arena_mark mark = arena_mark(arena);
	struct graph built = {
		.vertex_count = vertex_count,
		.edge_count = edge_count,
		.first = ARENA_ARRAY(arena, (size_t)vertex_count + 1, uint32_t),
		.head = ARENA_ARRAY(arena, arc_count, uint32_t),
		.edge = ARENA_ARRAY(arena, arc_count, uint32_t),
		.ends = ARENA_ARRAY(arena, arc_count, uint32_t),
		.weight = ARENA_ARRAY(arena, edge_count, uint64_t),
	};
	if (!built.first || !built.head || !built.edge || !built.ends || !built.weight) {
		arena_release(arena, mark);
		return tw_fail_memory(error);
	}
	if (edge_count) {
		memcpy(built.ends, ends, arc_count * sizeof *ends);
		memcpy(built.weight, weight, edge_count * sizeof *weight);
	}
	fill_rows(&built);
	*graph = built;
	return TW_OK;
}
