/* A graph that can be taken apart: what the reductions work on between two rebuilds of the instance. */
#ifndef SOLVER_STEINER_REDUCE_GRAPH_H
#define SOLVER_STEINER_REDUCE_GRAPH_H

#include "solver/steiner/search.h"

/* Side i of edge i / 2 lies at vertex end[i]; the sides at a vertex form a circle-free double list from first[v]. There
 * are no loops, and no parallel edges after reduce_graph_init. */
struct reduce_graph {
	uint32_t vertex_count;
	uint32_t edge_room;  /* slots */
	uint32_t edge_count; /* slots in use */
	uint32_t terminal_count;
	uint32_t *end;       /* [2 * edge_room]; INSTANCE_NONE in a free slot */
	uint32_t *next;      /* [2 * edge_room] */
	uint32_t *previous;  /* [2 * edge_room] */
	fine_t *weight;      /* [edge_room] */
	uint32_t *origin;    /* [edge_room] */
	uint32_t *free_slot; /* [edge_room] stack of free slots */
	uint32_t free_count;
	uint32_t *first;      /* [vertex_count] */
	uint32_t *degree;     /* [vertex_count] */
	uint8_t *is_terminal; /* [vertex_count] */
	uint32_t *beside;     /* [vertex_count] scratch of contractions: the side that leads to a neighbour */
	uint32_t *queue;      /* [vertex_count] ring of vertices whose surroundings changed */
	uint8_t *is_queued;   /* [vertex_count] */
	uint32_t queue_start, queue_count;
};

/* Copies the instance; every vertex is queued. */
enum tw_status reduce_graph_init(struct reduce_graph *graph, struct arena *arena,
				 const struct instance *instance) TW_NODISCARD;

/* Writes what is left back. */
enum tw_status reduce_graph_store(struct reduce_graph *graph, struct instance *instance,
				  struct arena *scratch) TW_NODISCARD;

/* The next vertex whose surroundings changed, INSTANCE_NONE when there is none. */
uint32_t reduce_graph_pop(struct reduce_graph *graph);

void reduce_graph_delete(struct reduce_graph *graph, uint32_t edge);

/* Adds an edge, or makes the one that is there lighter. False when there is no slot (nothing changed). */
int reduce_graph_add(struct reduce_graph *graph, uint32_t u, uint32_t v, fine_t weight, uint32_t origin);

/* Merges the ends of an edge, which becomes part of every tree. The vertex that is left is a terminal. */
void reduce_graph_take(struct reduce_graph *graph, struct instance *instance, uint32_t edge);

static inline uint32_t reduce_graph_other(const struct reduce_graph *graph, uint32_t side)
{
	return graph->end[side ^ 1];
}

#endif
