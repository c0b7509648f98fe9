/* Purpose: tests by bottleneck distances (C. W. Duin & A. Volgenant, Reduction tests for the Steiner problem in graphs,
 * Networks 19, 1989), computed fast and approximately from above as by T. Polzin & S. Vahdati Daneshmand (Improved
 * algorithms for the Steiner problem in networks, Discrete Appl. Math. 112, 2001).
 *
 * A walk from u to v breaks at the terminals that it meets into segments; the bottleneck Steiner distance s(u, v) is
 * the least, over all walks, of the longest segment. Every bound on s here is the longest segment of some walk.
 *
 * - Useless edge: s(u, v) < w(u, v). If an optimum had the edge, then without it the walk crosses from one half to the
 *   other within one segment, which is lighter than the edge (and so does not contain it): a lighter tree.
 * - Passed vertex v, not a terminal: for its three neighbours the lightest spanning tree by s weighs less than the
 * three edges. If an optimum had all three, dropping them and joining the halves by segments were lighter.
 * - Needed edge: the lightest edge (t, v) at a terminal t, if w(t, v) + d(v, z) is less than the second lightest, z
 * being another terminal. If an optimum lacked it, the first edge of its path from t to z could be swapped for it and
 * the path from v to z.
 *
 * All three ask for strictly less, so that they hold for *every* optimum: verdicts do not disturb each other and can
 * all be carried out at once, also where weights are equal. */
#include "solver/steiner/reduce/distance.h"

#include "solver/steiner/heap.h"
#include "solver/steiner/stamp.h"

#include <stdlib.h>
#include <string.h>

enum { NEAR = 3, LOCAL_ARCS_MAX = 400, LOCAL_ARCS_MIN = 50, ROUND_ARCS = 60000000 };
enum { SMALL_EDGES = 5000, SPARSE_PERCENT = 25, SAMPLE = 256, PAYING_PERCENT = 2 };

#define FAR FINE_MAX

/* The nearest terminals of a vertex, nearest first. */
struct near {
	fine_t distance[NEAR];
	uint32_t terminal[NEAR];
	uint32_t settled;
};

struct border {
	fine_t length;
	uint32_t a, b; /* terminals */
};

struct judge {
	struct search *search;
	const struct instance *instance;
	struct near *near; /* [vertex_count] */
	struct heap heap;
	/* The terminals' minimum spanning tree, as the tree of Kruskal's unions: the heaviest link on the way from one
	 * terminal to another over their parents is the heaviest edge between them in the spanning tree. */
	uint32_t *parent; /* [terminal_count] */
	fine_t *link;     /* [terminal_count] weight at which the terminal's tree was hung under the parent */
	uint32_t *size;   /* [terminal_count] */
	/* A bounded Dijkstra around one vertex. */
	uint32_t arcs_max; /* about so many are looked at: fewer in large graphs */
	uint32_t round;
	uint32_t *seen;   /* [vertex_count] */
	fine_t *distance; /* [vertex_count] valid where seen[v] == round */
};

static uint32_t local_arcs_max(const struct instance *instance)
{
	const uint32_t share = ROUND_ARCS / (instance->edge_count + 1);
	return share > LOCAL_ARCS_MAX ? LOCAL_ARCS_MAX : share < LOCAL_ARCS_MIN ? LOCAL_ARCS_MIN : share;
}

static enum tw_status judge_init(struct judge *judge, struct search *search)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	const size_t n = instance->vertex_count, m = instance->edge_count, k = instance->terminal_count;
	*judge = (struct judge){
		.search = search,
		.instance = instance,
		.near = ARENA_ARRAY(arena, n, struct near),
		.heap = {.entry = ARENA_ARRAY(arena, NEAR * 2 * m + k + 1, struct heap_entry),
			 .capacity = NEAR * 2 * m + k + 1},
		.parent = ARENA_ARRAY(arena, k, uint32_t),
		.link = ARENA_ARRAY(arena, k, fine_t),
		.size = ARENA_ARRAY(arena, k, uint32_t),
		.arcs_max = local_arcs_max(instance),
		.round = STAMP_FIRST,
		.seen = ARENA_ZEROED(arena, n, uint32_t),
		.distance = ARENA_ARRAY(arena, n, fine_t),
	};
	return judge->near && judge->heap.entry && judge->parent && judge->link && judge->size && judge->seen &&
			       judge->distance
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

static int has_near(const struct near *near, uint32_t terminal)
{
	for (uint32_t i = 0; i < near->settled; i++)
		if (near->terminal[i] == terminal)
			return 1;
	return 0;
}

/* The NEAR nearest terminals of every vertex. A terminal's search passes a vertex only if it is among the nearest
 * there, so every arc is looked at NEAR times at most. */
static int find_near(struct judge *judge)
{
	const struct instance *instance = judge->instance;
	struct heap *heap = &judge->heap;
	heap->count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		judge->near[v].settled = 0;
		for (uint32_t i = 0; i < NEAR; i++) {
			judge->near[v].distance[i] = FAR;
			judge->near[v].terminal[i] = INSTANCE_NONE;
		}
	}
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		heap_push(heap, 0, instance->terminal[t], t);
	while (heap->count) {
		const struct heap_entry top = heap_pop(heap);
		struct near *near = &judge->near[top.item];
		if (near->settled == NEAR || has_near(near, top.extra))
			continue;
		near->distance[near->settled] = top.key;
		near->terminal[near->settled++] = top.extra;
		const uint32_t end = instance->first[top.item + 1];
		for (uint32_t a = instance->first[top.item]; a < end; a++) {
			const struct near *other = &judge->near[instance->head[a]];
			if (other->settled < NEAR && !has_near(other, top.extra))
				heap_push(heap, top.key + instance->weight[instance->edge[a]], instance->head[a],
					  top.extra);
		}
		if (!search_spend(judge->search, end - instance->first[top.item]))
			return 0;
	}
	return 1;
}

static int compare_borders(const void *a, const void *b)
{
	const struct border *x = a, *y = b;
	if (x->length != y->length)
		return x->length < y->length ? -1 : 1;
	if (x->a != y->a)
		return x->a < y->a ? -1 : 1;
	return (x->b > y->b) - (x->b < y->b);
}

/* Minimum spanning tree of the terminals' distances, from the edges between Voronoi regions (Mehlhorn 1988). Unions by
 * size without shortening paths keep the parents' chains below log2(terminals). */
static void span_terminals(struct judge *judge)
{
	const struct instance *instance = judge->instance;
	struct border *borders = (struct border *)judge->heap.entry; /* the heap is empty, and larger */
	uint32_t count = 0;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		const struct near *u = &judge->near[instance->ends[2 * e]],
				  *v = &judge->near[instance->ends[2 * e + 1]];
		if (u->terminal[0] != v->terminal[0] && u->settled && v->settled)
			borders[count++] = (struct border){u->distance[0] + instance->weight[e] + v->distance[0],
							   u->terminal[0], v->terminal[0]};
	}
	qsort(borders, count, sizeof *borders, compare_borders);
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		judge->parent[t] = t;
		judge->link[t] = FAR;
		judge->size[t] = 1;
	}
	for (uint32_t i = 0; i < count; i++) {
		uint32_t a = borders[i].a, b = borders[i].b;
		while (judge->parent[a] != a)
			a = judge->parent[a];
		while (judge->parent[b] != b)
			b = judge->parent[b];
		if (a == b)
			continue;
		if (judge->size[a] > judge->size[b]) {
			const uint32_t c = a;
			a = b;
			b = c;
		}
		judge->parent[a] = b;
		judge->link[a] = borders[i].length;
		judge->size[b] += judge->size[a];
	}
}

/* The longest edge between two terminals in their spanning tree: links grow towards the root, so the end with the
 * lighter link climbs until both meet. */
static fine_t bottleneck(const struct judge *judge, uint32_t a, uint32_t b)
{
	fine_t longest = 0;
	while (a != b) {
		uint32_t *lower = judge->link[a] <= judge->link[b] ? &a : &b;
		if (judge->link[*lower] == FAR)
			return FAR;
		longest = judge->link[*lower];
		*lower = judge->parent[*lower];
	}
	return longest;
}

/* A bound on s(u, v) by walks over terminals near to both; gives up at `enough`. */
static fine_t distance_by_terminals(const struct judge *judge, uint32_t u, uint32_t v, fine_t enough)
{
	const struct near *p = &judge->near[u], *q = &judge->near[v];
	fine_t least = FAR;
	for (uint32_t i = 0; i < p->settled && p->distance[i] < least; i++)
		for (uint32_t j = 0; j < q->settled && q->distance[j] < least; j++) {
			fine_t longest = p->distance[i] > q->distance[j] ? p->distance[i] : q->distance[j];
			if (longest >= least)
				continue;
			const fine_t between = bottleneck(judge, p->terminal[i], q->terminal[j]);
			if (between > longest)
				longest = between;
			if (longest < least)
				least = longest;
			if (least < enough)
				return least;
		}
	return least;
}

/* Distances from u up to `radius` (exclusive), a few vertices at most; the labels of seen vertices are lengths of walks
 * even where the search ended before. Of a hub's row only the head is looked at, else each of its neighbours would look
 * at all the others; the row of u itself may count `own_row_max`. */
static void measure_around(struct judge *judge, uint32_t u, fine_t radius, uint32_t own_row_max)
{
	const struct instance *instance = judge->instance;
	struct heap *heap = &judge->heap;
	uint32_t arcs = 0;
	heap->count = 0;
	judge->round = stamp_next(judge->round, judge->seen, instance->vertex_count);
	judge->seen[u] = judge->round;
	judge->distance[u] = 0;
	heap_push(heap, 0, u, 0);
	while (heap->count && arcs < judge->arcs_max) {
		const struct heap_entry top = heap_pop(heap);
		if (top.key != judge->distance[top.item])
			continue;
		const uint32_t first = instance->first[top.item];
		const uint32_t whole = instance->first[top.item + 1] - first;
		const uint32_t row_max = top.item == u ? own_row_max : judge->arcs_max;
		const uint32_t end = first + (whole < row_max ? whole : row_max);
		arcs += end - first;
		for (uint32_t a = first; a < end; a++) {
			const uint32_t v = instance->head[a];
			const fine_t distance = top.key + instance->weight[instance->edge[a]];
			if (distance >= radius || (judge->seen[v] == judge->round && judge->distance[v] <= distance))
				continue;
			judge->seen[v] = judge->round;
			judge->distance[v] = distance;
			heap_push(heap, distance, v, 0);
		}
	}
	judge->search->work += arcs;
}

/* Judges the edges from u to later vertices. Walks over terminals only where `near` is known. */
static void judge_edges_at(struct judge *judge, uint32_t u, int with_terminals, struct reduce_verdict *verdict)
{
	const struct instance *instance = judge->instance;
	fine_t heaviest = 0;
	for (uint32_t a = instance->first[u]; a < instance->first[u + 1]; a++) {
		const uint32_t e = instance->edge[a], v = instance->head[a];
		if (v < u)
			continue;
		if (with_terminals && distance_by_terminals(judge, u, v, instance->weight[e]) < instance->weight[e])
			verdict->is_useless[e] = 1, verdict->count++;
		else if (instance->weight[e] > heaviest)
			heaviest = instance->weight[e];
	}
	if (!heaviest)
		return;
	measure_around(judge, u, heaviest, UINT32_MAX);
	for (uint32_t a = instance->first[u]; a < instance->first[u + 1]; a++) {
		const uint32_t e = instance->edge[a], v = instance->head[a];
		if (v < u || verdict->is_useless[e] || judge->seen[v] != judge->round)
			continue;
		if (judge->distance[v] < instance->weight[e])
			verdict->is_useless[e] = 1, verdict->count++;
	}
}

static fine_t least(fine_t a, fine_t b)
{
	return a < b ? a : b;
}

/* A vertex with three neighbours that no optimum uses as a branching point. */
static void judge_vertex(struct judge *judge, uint32_t v, struct reduce_verdict *verdict)
{
	const struct instance *instance = judge->instance;
	const uint32_t *head = instance->head + instance->first[v], *edge = instance->edge + instance->first[v];
	fine_t between[3], sum = 0, weight = 0, longest = 0;
	if (instance->terminal_at[v] != INSTANCE_NONE || instance->first[v + 1] - instance->first[v] != 3)
		return;
	for (uint32_t i = 0; i < 3; i++)
		weight += instance->weight[edge[i]];
	for (uint32_t i = 0; i < 3; i++) {
		const uint32_t a = head[i], b = head[(i + 1) % 3];
		between[i] = distance_by_terminals(judge, a, b, 0);
		measure_around(judge, a, least(weight, between[i]), judge->arcs_max);
		if (judge->seen[b] == judge->round)
			between[i] = least(between[i], judge->distance[b]);
		if (between[i] >= weight)
			return;
		sum += between[i];
		longest = between[i] > longest ? between[i] : longest;
	}
	if (sum - longest < weight)
		verdict->is_passed[v] = 1, verdict->count++;
}

static void judge_terminal(struct judge *judge, uint32_t t, struct reduce_verdict *verdict)
{
	const struct instance *instance = judge->instance;
	const uint32_t v = instance->terminal[t];
	uint32_t lightest = INSTANCE_NONE, to = INSTANCE_NONE;
	fine_t second = FAR;
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		const uint32_t e = instance->edge[a];
		if (lightest == INSTANCE_NONE || instance->weight[e] < instance->weight[lightest]) {
			second = lightest == INSTANCE_NONE ? FAR : instance->weight[lightest];
			lightest = e;
			to = instance->head[a];
		} else {
			second = least(second, instance->weight[e]);
		}
	}
	if (lightest == INSTANCE_NONE || verdict->is_needed[lightest])
		return;
	const struct near *near = &judge->near[to];
	for (uint32_t i = 0; i < near->settled; i++)
		if (near->terminal[i] != t) {
			if (second == FAR || instance->weight[lightest] + near->distance[i] < second)
				verdict->is_needed[lightest] = 1, verdict->count++;
			return;
		}
}

enum tw_status reduce_distance_judge(struct search *search, struct reduce_verdict *verdict)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	struct judge judge;
	enum tw_status status = judge_init(&judge, search);
	verdict->count = 0;
	memset(verdict->is_useless, 0, instance->edge_count);
	memset(verdict->is_needed, 0, instance->edge_count);
	memset(verdict->is_passed, 0, instance->vertex_count);
	if (status == TW_OK && !find_near(&judge))
		status = TW_ERROR_CANCELLED;
	if (status == TW_OK) {
		span_terminals(&judge);
		for (uint32_t v = 0; v < instance->vertex_count && status == TW_OK; v++) {
			judge_edges_at(&judge, v, 1, verdict);
			judge_vertex(&judge, v, verdict);
			if (!search_spend(search, 1))
				status = TW_ERROR_CANCELLED;
		}
		for (uint32_t t = 0; t < instance->terminal_count && instance->terminal_count > 1; t++)
			judge_terminal(&judge, t, verdict);
	}
	arena_release(search->arena, mark);
	return status;
}

int reduce_distance_pays(struct search *search)
{
	const struct instance *instance = &search->instance;
	const uint32_t n = instance->vertex_count, m = instance->edge_count;
	uint32_t sparse = 0, judged = 0;
	for (uint32_t v = 0; v < n; v++)
		sparse += instance->first[v + 1] - instance->first[v] < 4;
	if (m < SMALL_EDGES || sparse > n / 100 * SPARSE_PERCENT)
		return 1;
	const struct arena_mark mark = arena_mark(search->arena);
	struct judge judge;
	struct reduce_verdict verdict = {.is_useless = ARENA_ZEROED(search->arena, m, uint8_t)};
	if (verdict.is_useless && judge_init(&judge, search) == TW_OK)
		for (uint32_t i = 0; i < SAMPLE; i++) {
			const uint32_t v = (uint32_t)((uint64_t)i * n / SAMPLE);
			judge_edges_at(&judge, v, 0, &verdict);
			for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++)
				judged += instance->head[a] > v;
		}
	arena_release(search->arena, mark);
	return verdict.count * 100 > judged * PAYING_PERCENT;
}
