/* An undirected weighted graph in compressed sparse rows. Parallel edges and zero weights are allowed, loops are not.
 */
#ifndef SOLVER_GRAPH_GRAPH_H
#define SOLVER_GRAPH_GRAPH_H

#include "solver/arena.h"
#include "tightwire.h"

#define GRAPH_NONE UINT32_MAX

/* Arc a of vertex v: first[v] <= a < first[v + 1]; it leads to head[a] and is a side of the undirected edge edge[a].
 * The arcs of a vertex stand in the order of their edges, so that equal input gives equal rows. All arrays are borrowed
 * from the arena that built the graph. */
struct graph {
	uint32_t vertex_count;
	uint32_t edge_count;
	uint32_t *first;  /* [vertex_count + 1] */
	uint32_t *head;   /* [2 * edge_count] */
	uint32_t *edge;   /* [2 * edge_count] */
	uint32_t *ends;   /* [2 * edge_count]: the ends of edge e are ends[2e] and ends[2e + 1] */
	uint64_t *weight; /* [edge_count] */
};

/* Builds the rows from `ends` and `weight`, which are copied. TW_ERROR_INPUT names an edge that is a loop or leaves
 * 0…vertex_count-1, or a total weight that does not fit 62 bits; TW_ERROR_MEMORY. */
enum tw_status graph_build(struct graph *graph, struct arena *arena, uint32_t vertex_count, uint32_t edge_count,
			   const uint32_t *ends, const uint64_t *weight, struct tw_error *error) TW_NODISCARD;

#endif
