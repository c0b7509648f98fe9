/* Purpose: the bookkeeping of deletions and contractions. A contraction moves the sides of the vertex with fewer of
 * them, so that a side moves at most log2(n) times; edges that become parallel are compared through `beside`. */
#include "solver/steiner/reduce/graph.h"

#include <assert.h>
#include <string.h>

static void enqueue(struct reduce_graph *graph, uint32_t v)
{
	if (graph->is_queued[v])
		return;
	assert(graph->queue_count < graph->vertex_count);
	graph->is_queued[v] = 1;
	graph->queue[(graph->queue_start + graph->queue_count++) % graph->vertex_count] = v;
}

uint32_t reduce_graph_pop(struct reduce_graph *graph)
{
	if (!graph->queue_count)
		return INSTANCE_NONE;
	const uint32_t v = graph->queue[graph->queue_start];
	graph->queue_start = (graph->queue_start + 1) % graph->vertex_count;
	graph->queue_count--;
	graph->is_queued[v] = 0;
	return v;
}

static void link_side(struct reduce_graph *graph, uint32_t side, uint32_t v)
{
	graph->end[side] = v;
	graph->previous[side] = INSTANCE_NONE;
	graph->next[side] = graph->first[v];
	if (graph->first[v] != INSTANCE_NONE)
		graph->previous[graph->first[v]] = side;
	graph->first[v] = side;
	graph->degree[v]++;
}

static void unlink_side(struct reduce_graph *graph, uint32_t side)
{
	const uint32_t v = graph->end[side], next = graph->next[side], previous = graph->previous[side];
	if (previous == INSTANCE_NONE)
		graph->first[v] = next;
	else
		graph->next[previous] = next;
	if (next != INSTANCE_NONE)
		graph->previous[next] = previous;
	graph->degree[v]--;
}

enum tw_status reduce_graph_init(struct reduce_graph *graph, struct arena *arena, const struct instance *instance)
{
	const size_t n = instance->vertex_count, m = instance->edge_count;
	*graph = (struct reduce_graph){
		.vertex_count = instance->vertex_count,
		.edge_room = instance->edge_count,
		.edge_count = instance->edge_count,
		.terminal_count = instance->terminal_count,
		.end = ARENA_ARRAY(arena, 2 * m, uint32_t),
		.next = ARENA_ARRAY(arena, 2 * m, uint32_t),
		.previous = ARENA_ARRAY(arena, 2 * m, uint32_t),
		.weight = ARENA_ARRAY(arena, m, fine_t),
		.origin = ARENA_ARRAY(arena, m, uint32_t),
		.free_slot = ARENA_ARRAY(arena, m, uint32_t),
		.first = ARENA_ARRAY(arena, n, uint32_t),
		.degree = ARENA_ZEROED(arena, n, uint32_t),
		.is_terminal = ARENA_ZEROED(arena, n, uint8_t),
		.beside = ARENA_ARRAY(arena, n, uint32_t),
		.queue = ARENA_ARRAY(arena, n, uint32_t),
		.is_queued = ARENA_ZEROED(arena, n, uint8_t),
	};
	if (!graph->end || !graph->next || !graph->previous || !graph->weight || !graph->origin || !graph->free_slot ||
	    !graph->first || !graph->degree || !graph->is_terminal || !graph->beside || !graph->queue ||
	    !graph->is_queued)
		return TW_ERROR_MEMORY;
	memset(graph->first, 0xff, n * sizeof *graph->first);
	memset(graph->beside, 0xff, n * sizeof *graph->beside);
	memcpy(graph->weight, instance->weight, m * sizeof *graph->weight);
	memcpy(graph->origin, instance->origin, m * sizeof *graph->origin);
	for (uint32_t side = 2 * instance->edge_count; side-- > 0;)
		link_side(graph, side, instance->ends[side]);
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		graph->is_terminal[instance->terminal[t]] = 1;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		enqueue(graph, v);
	return TW_OK;
}

enum tw_status reduce_graph_store(struct reduce_graph *graph, struct instance *instance, struct arena *scratch)
{
	const struct arena_mark mark = arena_mark(scratch);
	struct instance_edit edit = {
		.ends = ARENA_ARRAY(scratch, 2 * (size_t)graph->edge_count, uint32_t),
		.weight = ARENA_ARRAY(scratch, graph->edge_count, fine_t),
		.origin = ARENA_ARRAY(scratch, graph->edge_count, uint32_t),
		.terminal = ARENA_ARRAY(scratch, graph->terminal_count, uint32_t),
	};
	enum tw_status status = edit.ends && edit.weight && edit.origin && edit.terminal ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (uint32_t e = 0; e < graph->edge_room; e++) {
			if (graph->end[2 * e] == INSTANCE_NONE)
				continue;
			const uint32_t i = edit.edge_count++;
			edit.ends[2 * i] = graph->end[2 * e];
			edit.ends[2 * i + 1] = graph->end[2 * e + 1];
			edit.weight[i] = graph->weight[e];
			edit.origin[i] = graph->origin[e];
		}
		for (uint32_t v = 0; v < graph->vertex_count; v++)
			if (graph->is_terminal[v])
				edit.terminal[edit.terminal_count++] = v;
		status = instance_replace(instance, scratch, &edit, NULL);
	}
	arena_release(scratch, mark);
	return status;
}

void reduce_graph_delete(struct reduce_graph *graph, uint32_t edge)
{
	assert(graph->end[2 * edge] != INSTANCE_NONE);
	for (uint32_t side = 2 * edge; side < 2 * edge + 2; side++) {
		enqueue(graph, graph->end[side]);
		unlink_side(graph, side);
		graph->end[side] = INSTANCE_NONE;
	}
	graph->free_slot[graph->free_count++] = edge;
	graph->edge_count--;
}

int reduce_graph_add(struct reduce_graph *graph, uint32_t u, uint32_t v, fine_t weight, uint32_t origin)
{
	const uint32_t from = graph->degree[u] < graph->degree[v] ? u : v, to = u ^ v ^ from;
	for (uint32_t side = graph->first[from]; side != INSTANCE_NONE; side = graph->next[side]) {
		if (reduce_graph_other(graph, side) != to)
			continue;
		if (weight < graph->weight[side / 2]) {
			graph->weight[side / 2] = weight;
			graph->origin[side / 2] = origin;
			enqueue(graph, u);
			enqueue(graph, v);
		}
		return 1;
	}
	if (!graph->free_count)
		return 0;
	const uint32_t edge = graph->free_slot[--graph->free_count];
	graph->weight[edge] = weight;
	graph->origin[edge] = origin;
	link_side(graph, 2 * edge, u);
	link_side(graph, 2 * edge + 1, v);
	graph->edge_count++;
	enqueue(graph, u);
	enqueue(graph, v);
	return 1;
}

/* Moves the sides of `gone` to `stays`; of two edges to the same neighbour the lighter one is left. */
static void move_sides(struct reduce_graph *graph, uint32_t gone, uint32_t stays)
{
	for (uint32_t side = graph->first[stays]; side != INSTANCE_NONE; side = graph->next[side]) {
		assert(graph->beside[reduce_graph_other(graph, side)] == INSTANCE_NONE);
		graph->beside[reduce_graph_other(graph, side)] = side;
	}
	for (uint32_t side = graph->first[gone], next; side != INSTANCE_NONE; side = next) {
		next = graph->next[side];
		const uint32_t u = reduce_graph_other(graph, side), twin = graph->beside[u];
		enqueue(graph, u);
		if (twin == INSTANCE_NONE) {
			unlink_side(graph, side);
			link_side(graph, side, stays);
			continue;
		}
		if (graph->weight[side / 2] < graph->weight[twin / 2]) {
			graph->weight[twin / 2] = graph->weight[side / 2];
			graph->origin[twin / 2] = graph->origin[side / 2];
		}
		reduce_graph_delete(graph, side / 2);
	}
	for (uint32_t side = graph->first[stays]; side != INSTANCE_NONE; side = graph->next[side])
		graph->beside[reduce_graph_other(graph, side)] = INSTANCE_NONE;
}

void reduce_graph_take(struct reduce_graph *graph, struct instance *instance, uint32_t edge)
{
	const uint32_t u = graph->end[2 * edge], v = graph->end[2 * edge + 1];
	const uint32_t gone = graph->degree[u] < graph->degree[v] ? u : v, stays = u ^ v ^ gone;
	instance_take(instance, graph->origin[edge], graph->weight[edge]);
	reduce_graph_delete(graph, edge);
	move_sides(graph, gone, stays);
	graph->terminal_count -= graph->is_terminal[u] && graph->is_terminal[v];
	graph->terminal_count += !graph->is_terminal[u] && !graph->is_terminal[v];
	graph->is_terminal[gone] = 0;
	graph->is_terminal[stays] = 1;
	enqueue(graph, stays);
}
