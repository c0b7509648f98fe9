/* The independent verifier. It shares neither code nor data with the solver: it reads only the graph's `ends` and
 * `weight` (not the rows that the solver walks), and keeps three arrays of its own.
 *
 * Distinct edges that never join two vertices already joined form a forest (union-find; Galler & Fischer 1964). A
 * forest with k edges that touches k + 1 vertices is one tree. It spans the terminals if each of them is touched; the
 * only tree that touches nothing is that of a single terminal. */
#include "solver/steiner/steiner.h"

#include <stdlib.h>

struct check {
	uint32_t *parent;     /* [vertex_count] union-find */
	uint32_t *degree;     /* [vertex_count] in the tree */
	uint8_t *seen;        /* [edge_count] the edge is in the tree */
	uint8_t *is_terminal; /* [vertex_count] */
};

static enum tw_status refuse(struct tw_error *error, const char *kind, uint32_t index, const char *what)
{
	char where[48];
	snprintf(where, sizeof where, "%s %u", kind, index);
	return tw_fail(error, TW_ERROR_INTERNAL, "steiner-tree-invalid", where, "%s", what);
}

static uint32_t find_root(uint32_t *parent, uint32_t v)
{
	while (parent[v] != v) {
		parent[v] = parent[parent[v]];
		v = parent[v];
	}
	return v;
}

static enum tw_status mark_terminals(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
				     struct check *check, struct tw_error *error)
{
	if (!terminal_count)
		return tw_fail(error, TW_ERROR_INTERNAL, "steiner-tree-invalid", NULL, "there are no terminals");
	for (uint32_t i = 0; i < terminal_count; i++) {
		if (terminals[i] >= graph->vertex_count)
			return refuse(error, "terminal", i, "is not a vertex of the graph");
		check->is_terminal[terminals[i]] = 1;
	}
	return TW_OK;
}

static enum tw_status join_edges(const struct graph *graph, const uint32_t *edges, uint32_t edge_count, uint64_t weight,
				 struct check *check, struct tw_error *error)
{
	uint64_t sum = 0;
	for (uint32_t i = 0; i < edge_count; i++) {
		const uint32_t e = edges[i];
		if (e >= graph->edge_count)
			return refuse(error, "tree edge", i, "is not an edge of the graph");
		if (check->seen[e])
			return refuse(error, "edge", e, "stands in the tree twice");
		check->seen[e] = 1;
		const uint32_t u = graph->ends[2 * (size_t)e], v = graph->ends[2 * (size_t)e + 1];
		const uint32_t a = find_root(check->parent, u), b = find_root(check->parent, v);
		if (a == b)
			return refuse(error, "edge", e, "closes a cycle");
		check->parent[a] = b;
		check->degree[u]++;
		check->degree[v]++;
		if (__builtin_add_overflow(sum, graph->weight[e], &sum))
			return refuse(error, "edge", e, "makes the weight overflow");
	}
	if (sum != weight)
		return tw_fail(error, TW_ERROR_INTERNAL, "steiner-tree-invalid", NULL,
			       "the edges weigh %llu, not %llu as claimed", (unsigned long long)sum,
			       (unsigned long long)weight);
	return TW_OK;
}

static enum tw_status check_shape(const struct graph *graph, uint32_t terminal, uint32_t edge_count,
				  const struct check *check, struct tw_error *error)
{
	uint64_t touched = 0;
	for (uint32_t v = 0; v < graph->vertex_count; v++) {
		touched += check->degree[v] > 0;
		if (check->is_terminal[v] && !check->degree[v] && (edge_count || v != terminal))
			return refuse(error, "terminal vertex", v, "is not spanned");
		if (!check->is_terminal[v] && check->degree[v] == 1)
			return refuse(error, "vertex", v, "is a leaf but not a terminal");
	}
	if (edge_count && touched != (uint64_t)edge_count + 1)
		return tw_fail(error, TW_ERROR_INTERNAL, "steiner-tree-invalid", NULL,
			       "%u edges touch %llu vertices: more than one tree", edge_count,
			       (unsigned long long)touched);
	return TW_OK;
}

enum tw_status steiner_verify(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			      const uint32_t *edges, uint32_t edge_count, uint64_t weight, struct tw_error *error)
{
	const size_t n = graph->vertex_count;
	struct check check = {
		.parent = calloc(n + 1, sizeof(uint32_t)),
		.degree = calloc(n + 1, sizeof(uint32_t)),
		.seen = calloc((size_t)graph->edge_count + 1, 1),
		.is_terminal = calloc(n + 1, 1),
	};
	enum tw_status status;
	if (!check.parent || !check.degree || !check.seen || !check.is_terminal) {
		status = tw_fail_memory(error);
	} else {
		for (uint32_t v = 0; v < n; v++)
			check.parent[v] = v;
		status = mark_terminals(graph, terminals, terminal_count, &check, error);
		if (status == TW_OK)
			status = join_edges(graph, edges, edge_count, weight, &check, error);
		if (status == TW_OK)
			status = check_shape(graph, terminals[0], edge_count, &check, error);
	}
	free(check.parent);
	free(check.degree);
	free(check.seen);
	free(check.is_terminal);
	return status;
}
