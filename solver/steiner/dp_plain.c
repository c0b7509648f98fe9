/* Purpose: the plain dynamic program over terminal sets, without any pruning.
 *
 * S. E. Dreyfus & R. A. Wagner, The Steiner problem in graphs (Networks 1, 1971), in the form of R. E. Erickson, C. L.
 * Monma & A. F. Veinott (Math. Oper. Res. 12, 1987). Let cost(I, v) be the least weight of a tree that spans the
 * terminals I and the vertex v. Such a tree either falls apart at v into trees for two parts of I (merge), or hangs on
 * an edge at v (grow): merging gives start labels and one Dijkstra grows them. The last terminal is the root: the
 * answer is cost(all others, root). 3^k n time, 2^k n memory. */
#include "solver/steiner/dp.h"

#include "solver/steiner/heap.h"

#include <string.h>

enum { PLAIN_TERMINALS = 20 };

/* How a label came to be: an edge, or a part of the set; the highest bit tells which. */
#define FROM_MERGE 0x80000000u
#define FROM_NOTHING UINT32_MAX

struct plain {
	uint64_t *cost; /* [sets * vertex_count] */
	uint32_t *from; /* [sets * vertex_count] */
	struct heap heap;
};

static void merge(const struct plain *plain, size_t n, uint32_t set)
{
	uint64_t *cost = plain->cost + set * n;
	uint32_t *from = plain->from + set * n;
	for (uint32_t part = (set - 1) & set; part > (set ^ part); part = (part - 1) & set) {
		const uint64_t *a = plain->cost + part * n, *b = plain->cost + (set ^ part) * n;
		for (size_t v = 0; v < n; v++)
			if (a[v] + b[v] < cost[v]) {
				cost[v] = a[v] + b[v];
				from[v] = FROM_MERGE | part;
			}
	}
}

static void grow(struct search *search, struct plain *plain, uint32_t set)
{
	const struct instance *instance = &search->instance;
	size_t n = instance->vertex_count;
	uint64_t *cost = plain->cost + set * n;
	uint32_t *from = plain->from + set * n;
	struct heap *heap = &plain->heap;
	for (uint32_t v = 0; v < n; v++)
		if (cost[v] < UINT64_MAX / 4)
			heap_push(heap, cost[v], v, 0);
	while (heap->count) {
		struct heap_entry top = heap_pop(heap);
		uint32_t v = top.item;
		if (top.key != cost[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint64_t longer = top.key + instance->weight[instance->edge[a]];
			uint32_t u = instance->head[a];
			if (longer >= cost[u])
				continue;
			cost[u] = longer;
			from[u] = instance->edge[a];
			heap_push(heap, longer, u, 0);
		}
	}
}

static uint32_t trace(const struct instance *instance, const struct plain *plain, uint32_t set, uint32_t v,
		      uint32_t *edges, uint32_t count)
{
	for (;;) {
		uint32_t from = plain->from[(size_t)set * instance->vertex_count + v];
		if (from == FROM_NOTHING)
			return count;
		if (from & FROM_MERGE) {
			uint32_t part = from & ~FROM_MERGE;
			count = trace(instance, plain, part, v, edges, count);
			set ^= part;
		} else {
			edges[count++] = from;
			v ^= instance->ends[2 * from] ^ instance->ends[2 * from + 1];
		}
	}
}

static enum tw_status run(struct search *search, struct plain *plain, uint32_t sets)
{
	const struct instance *instance = &search->instance;
	size_t n = instance->vertex_count;
	for (uint32_t set = 1; set < sets; set++) {
		memset(plain->from + set * n, 0xff, n * sizeof *plain->from);
		for (size_t v = 0; v < n; v++)
			plain->cost[set * n + v] = UINT64_MAX / 4;
		if (!(set & (set - 1)))
			plain->cost[set * n + instance->terminal[__builtin_ctz(set)]] = 0;
		merge(plain, n, set);
		grow(search, plain, set);
		search->stats->sets++;
		search->stats->labels += n;
		if (!search_spend(search, 2 * instance->edge_count + n * ((1u << __builtin_popcount(set)) >> 4)))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

enum tw_status dp_solve_plain(struct search *search, int *found)
{
	const struct instance *instance = &search->instance;
	if (instance->terminal_count > PLAIN_TERMINALS)
		return TW_ERROR_UNSUPPORTED;
	size_t n = instance->vertex_count;
	uint32_t sets = 1u << (instance->terminal_count - 1);
	struct arena *arena = search->arena;
	struct arena_mark mark = arena_mark(arena);
	struct plain plain = {
		.cost = ARENA_ARRAY(arena, sets * n, uint64_t),
		.from = ARENA_ARRAY(arena, sets * n, uint32_t),
		.heap = {.entry = ARENA_ARRAY(arena, 2 * (size_t)instance->edge_count + n, struct heap_entry)},
	};
	uint32_t *edges = ARENA_ARRAY(arena, instance->edge_count + n, uint32_t);
	*found = 0;
	enum tw_status status = TW_ERROR_MEMORY;
	if (plain.cost && plain.from && plain.heap.entry && edges) {
		status = run(search, &plain, sets);
		if (status == TW_OK) {
			uint32_t root = instance->terminal[instance->terminal_count - 1];
			uint32_t count = sets > 1 ? trace(instance, &plain, sets - 1, root, edges, 0) : 0;
			status = search_offer(search, edges, count);
			*found = status == TW_OK;
		}
	}
	arena_release(arena, mark);
	return status;
}
