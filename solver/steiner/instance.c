/* Purpose: build, shrink and expand instances. Everything is a rebuild of the rows from an edge list: a stage that
 * deletes or contracts describes what is left, and instance_replace numbers it densely again. That costs one pass over
 * the edges, which every stage spends many times over anyway, and leaves arrays without holes for the hot loops. */
#include "solver/steiner/instance.h"

#include "solver/splitmix.h"

#include <assert.h>
#include <string.h>

static unsigned bits(uint64_t x)
{
	return x ? 64u - (unsigned)__builtin_clzll(x) : 0u;
}

/* A hash of 10 bits leaves one tie in a thousand, and the dual, whose costs are the upper 30 bits of a tree's weight,
 * much of the weight. */
enum { TIE_BITS = 32, HASH_BITS = 10 };

/* So much smaller than a unit are the hashes of a tree: what they add is lost where bounds are rounded up to units. */
enum { SPARE_BITS = 4 };

/* A tree has fewer edges than 2^bits(vertices). */
static unsigned tie_bits_of_tree(const struct graph *graph, const uint32_t *ties)
{
	return bits(graph->vertex_count) + (ties ? TIE_BITS : HASH_BITS);
}

static uint64_t hash_of_ends(const struct graph *graph, uint32_t edge)
{
	const uint64_t u = graph->ends[2 * (size_t)edge], v = graph->ends[2 * (size_t)edge + 1];
	return splitmix((u < v ? u << 32 | v : v << 32 | u) * SPLITMIX_STEP) >> (64 - HASH_BITS);
}

fine_t instance_fine(const struct instance *instance, const struct graph *graph, uint32_t edge)
{
	const fine_t whole = (fine_t)graph->weight[edge] << instance->shift;
	if (!instance->shift)
		return whole;
	return whole | (instance->ties ? instance->ties[edge] : hash_of_ends(graph, edge));
}

static void fill_rows(struct instance *instance)
{
	uint32_t n = instance->vertex_count, m = instance->edge_count, *first = instance->first;
	const uint32_t *ends = instance->ends;
	memset(first, 0, ((size_t)n + 1) * sizeof *first);
	for (uint32_t i = 0; i < 2 * m; i++)
		first[ends[i] + 1]++;
	for (uint32_t v = 0; v < n; v++)
		first[v + 1] += first[v];
	for (uint32_t e = 0; e < m; e++) {
		uint32_t u = ends[2 * e], v = ends[2 * e + 1];
		instance->head[first[u]] = v, instance->edge[first[u]++] = e;
		instance->head[first[v]] = u, instance->edge[first[v]++] = e;
	}
	memmove(first + 1, first, (size_t)n * sizeof *first);
	first[0] = 0;
}

/* Numbers the component of `start` breadth first, so that neighbours in the graph are neighbours in memory, whatever
 * order the caller has (E. Cuthill & J. McKee, Reducing the bandwidth of sparse symmetric matrices, ACM 1969).
 * queue[i] becomes the vertex numbered i; number[v] is INSTANCE_NONE elsewhere. Returns how many there are. */
static uint32_t number_component(const struct graph *graph, uint32_t start, uint32_t *number, uint32_t *queue)
{
	uint32_t count = 0;
	memset(number, 0xff, graph->vertex_count * sizeof *number);
	number[start] = 0;
	queue[count++] = start;
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t a = graph->first[queue[i]]; a < graph->first[queue[i] + 1]; a++)
			if (number[graph->head[a]] == INSTANCE_NONE) {
				number[graph->head[a]] = count;
				queue[count++] = graph->head[a];
			}
	return count;
}

/* Copies the edges of the component in the order of the vertices' numbers. */
static void copy_component(struct instance *instance, const struct graph *graph, const uint32_t *number,
			   const uint32_t *queue)
{
	for (uint32_t u = 0; u < instance->vertex_count; u++)
		for (uint32_t a = graph->first[queue[u]]; a < graph->first[queue[u] + 1]; a++) {
			const uint32_t v = number[graph->head[a]], e = graph->edge[a], i = instance->edge_count;
			if (v <= u)
				continue;
			instance->edge_count++;
			/* As the caller has them: certify.c tells the vertices' names by that. */
			instance->ends[2 * i] = number[graph->ends[2 * e]];
			instance->ends[2 * i + 1] = number[graph->ends[2 * e + 1]];
			instance->weight[i] = instance_fine(instance, graph, e);
			instance->origin[i] = e;
		}
}

static int allocate(struct instance *instance, struct arena *arena, uint32_t n, uint32_t m, uint32_t k)
{
	instance->first = ARENA_ARRAY(arena, (size_t)n + 1, uint32_t);
	instance->head = ARENA_ARRAY(arena, 2 * (size_t)m, uint32_t);
	instance->edge = ARENA_ARRAY(arena, 2 * (size_t)m, uint32_t);
	instance->ends = ARENA_ARRAY(arena, 2 * (size_t)m, uint32_t);
	instance->weight = ARENA_ARRAY(arena, m, fine_t);
	instance->origin = ARENA_ARRAY(arena, m, uint32_t);
	instance->terminal = ARENA_ARRAY(arena, k, uint32_t);
	instance->terminal_at = ARENA_ARRAY(arena, n, uint32_t);
	return instance->first && instance->head && instance->edge && instance->ends && instance->weight &&
	       instance->origin && instance->terminal && instance->terminal_at;
}

static int allocate_history(struct instance *instance, struct arena *arena, uint32_t pairs, uint32_t taken)
{
	instance->pair_capacity = pairs;
	instance->taken_capacity = taken;
	instance->pair = arena_array(arena, pairs, sizeof *instance->pair);
	instance->taken = ARENA_ARRAY(arena, taken, uint32_t);
	return instance->pair && instance->taken;
}

enum tw_status instance_init(struct instance *instance, struct arena *arena, const struct graph *graph,
			     const uint32_t *terminals, uint32_t terminal_count, const uint32_t *ties, bool perturb,
			     uint32_t apart[2])
{
	uint32_t n = graph->vertex_count, m = graph->edge_count;
	*instance = (struct instance){
		.origin_leaf_count = m,
		.shift = perturb ? tie_bits_of_tree(graph, ties) + (ties ? 0 : SPARE_BITS) : 0,
		.tie_limit = perturb ? (fine_t)1 << tie_bits_of_tree(graph, ties) : 1,
		.ties = perturb ? ties : NULL,
	};
	if (!allocate(instance, arena, n, m, terminal_count) || !allocate_history(instance, arena, m, n))
		return TW_ERROR_MEMORY;

	struct arena_mark mark = arena_mark(arena);
	uint32_t *queue = ARENA_ARRAY(arena, n, uint32_t);
	uint32_t *number = ARENA_ARRAY(arena, n, uint32_t);
	enum tw_status status = queue && number ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		instance->vertex_count = number_component(graph, terminals[0], number, queue);
		for (uint32_t i = 0; i < terminal_count && status == TW_OK; i++)
			if (number[terminals[i]] == INSTANCE_NONE) {
				apart[0] = terminals[0];
				apart[1] = terminals[i];
				status = TW_ERROR_NOT_FOUND;
			}
	}
	if (status == TW_OK) {
		copy_component(instance, graph, number, queue);
		memset(instance->terminal_at, 0xff, (size_t)instance->vertex_count * sizeof(uint32_t));
		for (uint32_t i = 0; i < terminal_count; i++) {
			uint32_t v = number[terminals[i]];
			if (instance->terminal_at[v] != INSTANCE_NONE)
				continue;
			instance->terminal_at[v] = instance->terminal_count;
			instance->terminal[instance->terminal_count++] = v;
		}
		fill_rows(instance);
	}
	arena_release(arena, mark);
	return status;
}

enum tw_status instance_copy(struct instance *to, const struct instance *from, struct arena *arena)
{
	uint32_t n = from->vertex_count, m = from->edge_count;
	*to = *from;
	/* The history may grow by a pair for every edge and a taken origin for every vertex that is left. */
	if (!allocate(to, arena, n, m, from->terminal_count) ||
	    !allocate_history(to, arena, from->pair_count + m, from->taken_count + n))
		return TW_ERROR_MEMORY;
	memcpy(to->first, from->first, ((size_t)n + 1) * sizeof *to->first);
	memcpy(to->head, from->head, 2 * (size_t)m * sizeof *to->head);
	memcpy(to->edge, from->edge, 2 * (size_t)m * sizeof *to->edge);
	memcpy(to->ends, from->ends, 2 * (size_t)m * sizeof *to->ends);
	memcpy(to->weight, from->weight, (size_t)m * sizeof *to->weight);
	memcpy(to->origin, from->origin, (size_t)m * sizeof *to->origin);
	memcpy(to->terminal, from->terminal, from->terminal_count * sizeof *to->terminal);
	memcpy(to->terminal_at, from->terminal_at, (size_t)n * sizeof *to->terminal_at);
	memcpy(to->pair, from->pair, from->pair_count * sizeof *to->pair);
	memcpy(to->taken, from->taken, from->taken_count * sizeof *to->taken);
	return TW_OK;
}

uint32_t instance_join(struct instance *instance, uint32_t origin_a, uint32_t origin_b)
{
	if (instance->pair_count == instance->pair_capacity)
		return INSTANCE_NONE;
	instance->pair[instance->pair_count][0] = origin_a;
	instance->pair[instance->pair_count][1] = origin_b;
	return instance->origin_leaf_count + instance->pair_count++;
}

void instance_take(struct instance *instance, uint32_t origin, fine_t weight)
{
	/* Every taken origin contracts an edge, and there is room for one for each vertex. */
	assert(instance->taken_count < instance->taken_capacity);
	instance->taken[instance->taken_count++] = origin;
	instance->base += weight;
}

/* Drops all but the lightest of parallel edges, in place: for each vertex in turn the edges to later vertices. */
static void drop_parallel(struct instance_edit *edit, uint32_t n, const uint32_t *first, const uint32_t *row,
			  uint32_t *lightest, uint8_t *drop)
{
	memset(lightest, 0xff, (size_t)n * sizeof *lightest);
	for (uint32_t v = 0; v < n; v++) {
		for (uint32_t a = first[v]; a < first[v + 1]; a++) {
			uint32_t e = row[a], u = edit->ends[2 * e] ^ edit->ends[2 * e + 1] ^ v, other = lightest[u];
			if (u < v)
				continue;
			if (other == INSTANCE_NONE) {
				lightest[u] = e;
			} else if (edit->weight[e] < edit->weight[other]) {
				drop[other] = 1;
				lightest[u] = e;
			} else {
				drop[e] = 1;
			}
		}
		for (uint32_t a = first[v]; a < first[v + 1]; a++)
			lightest[edit->ends[2 * row[a]] ^ edit->ends[2 * row[a] + 1] ^ v] = INSTANCE_NONE;
	}
}

static void copy_edges(struct instance *instance, const struct instance_edit *edit, const uint8_t *drop,
		       const uint32_t *number)
{
	uint32_t count = 0;
	for (uint32_t e = 0; e < edit->edge_count; e++) {
		if (drop && drop[e])
			continue;
		instance->ends[2 * count] = number[edit->ends[2 * e]];
		instance->ends[2 * count + 1] = number[edit->ends[2 * e + 1]];
		instance->weight[count] = edit->weight[e];
		instance->origin[count] = edit->origin[e];
		count++;
	}
	assert(count <= edit->edge_count);
	instance->edge_count = count;
}

/* Numbers the vertices in use densely in `number`, then moves edges and terminals over. */
static void renumber(struct instance *instance, const struct instance_edit *edit, const uint8_t *drop, uint32_t *number)
{
	uint32_t n = instance->vertex_count, count = 0;
	memset(number, 0xff, (size_t)n * sizeof *number);
	for (uint32_t i = 0; i < 2 * edit->edge_count; i++)
		if (!drop || !drop[i / 2])
			number[edit->ends[i]] = 0;
	for (uint32_t t = 0; t < edit->terminal_count; t++)
		number[edit->terminal[t]] = 0;
	for (uint32_t v = 0; v < n; v++)
		if (number[v] == 0)
			number[v] = count++;
	instance->vertex_count = count;
	copy_edges(instance, edit, drop, number);
	instance->terminal_count = edit->terminal_count;
	memset(instance->terminal_at, 0xff, (size_t)count * sizeof(uint32_t));
	for (uint32_t t = 0; t < edit->terminal_count; t++) {
		instance->terminal[t] = number[edit->terminal[t]];
		instance->terminal_at[instance->terminal[t]] = t;
	}
	fill_rows(instance);
}

enum tw_status instance_replace(struct instance *instance, struct arena *scratch, struct instance_edit *edit,
				uint32_t *number)
{
	struct arena_mark mark = arena_mark(scratch);
	size_t n = instance->vertex_count, m = edit->edge_count;
	uint32_t *first = ARENA_ZEROED(scratch, n + 2, uint32_t);
	uint32_t *row = ARENA_ARRAY(scratch, 2 * m, uint32_t);
	uint32_t *lightest = ARENA_ARRAY(scratch, n, uint32_t);
	uint8_t *drop = ARENA_ZEROED(scratch, m, uint8_t);
	enum tw_status status = first && row && lightest && drop ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (size_t i = 0; i < 2 * m; i++)
			first[edit->ends[i] + 2]++;
		for (size_t v = 0; v < n; v++)
			first[v + 2] += first[v + 1];
		for (size_t i = 0; i < 2 * m; i++)
			row[first[edit->ends[i] + 1]++] = (uint32_t)(i / 2);
		drop_parallel(edit, (uint32_t)n, first, row, lightest, drop);
		renumber(instance, edit, drop, number ? number : lightest);
	}
	arena_release(scratch, mark);
	return status;
}

enum tw_status instance_keep(struct instance *instance, struct arena *scratch, const uint8_t *keep, uint32_t *number)
{
	struct arena_mark mark = arena_mark(scratch);
	size_t k = instance->terminal_count;
	uint32_t *buffer = ARENA_ARRAY(scratch, number ? 1 : instance->vertex_count, uint32_t);
	uint32_t *terminal = ARENA_ARRAY(scratch, k, uint32_t);
	enum tw_status status = buffer && terminal ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		uint32_t count = 0;
		for (uint32_t e = 0; e < instance->edge_count; e++) {
			if (!keep[e])
				continue;
			instance->ends[2 * count] = instance->ends[2 * e];
			instance->ends[2 * count + 1] = instance->ends[2 * e + 1];
			instance->weight[count] = instance->weight[e];
			instance->origin[count++] = instance->origin[e];
		}
		memcpy(terminal, instance->terminal, k * sizeof *terminal);
		/* Writing never overtakes reading, so that the arrays can be their own source. */
		struct instance_edit edit = {.edge_count = count,
					     .ends = instance->ends,
					     .weight = instance->weight,
					     .origin = instance->origin,
					     .terminal_count = (uint32_t)k,
					     .terminal = terminal};
		renumber(instance, &edit, NULL, number ? number : buffer);
	}
	arena_release(scratch, mark);
	return status;
}

enum tw_status instance_part(struct instance *to, const struct instance *from, struct arena *arena, const uint8_t *keep)
{
	const uint32_t n = from->vertex_count, k = from->terminal_count;
	uint32_t m = 0, count = 0;
	for (uint32_t e = 0; e < from->edge_count; e++)
		m += keep[e] != 0;
	const uint32_t most =
		m < n && k < n - m ? m + k : n; /* vertices: each part of a forest has one more than edges */
	*to = *from;
	if (!allocate(to, arena, most, m, k) ||
	    !allocate_history(to, arena, from->pair_count + m, from->taken_count + most))
		return TW_ERROR_MEMORY;
	memcpy(to->pair, from->pair, from->pair_count * sizeof *to->pair);
	memcpy(to->taken, from->taken, from->taken_count * sizeof *to->taken);
	for (uint32_t e = 0; e < from->edge_count; e++) {
		if (!keep[e])
			continue;
		to->ends[2 * count] = from->ends[2 * e];
		to->ends[2 * count + 1] = from->ends[2 * e + 1];
		to->weight[count] = from->weight[e];
		to->origin[count++] = from->origin[e];
	}
	const struct arena_mark mark = arena_mark(arena);
	uint32_t *number = ARENA_ARRAY(arena, n, uint32_t);
	if (number)
		renumber(to,
			 &(struct instance_edit){.edge_count = m,
						 .ends = to->ends,
						 .weight = to->weight,
						 .origin = to->origin,
						 .terminal_count = k,
						 .terminal = from->terminal},
			 NULL, number);
	arena_release(arena, mark);
	return number ? TW_OK : TW_ERROR_MEMORY;
}

enum tw_status instance_expand(const struct instance *instance, struct arena *scratch, const uint32_t *edges,
			       uint32_t edge_count, uint32_t *leaves, uint32_t *leaf_count)
{
	struct arena_mark mark = arena_mark(scratch);
	uint32_t leaf_limit = instance->origin_leaf_count;
	/* Every pair is opened once, so that a stack of all pairs and all starting origins suffices. */
	size_t room = (size_t)edge_count + instance->taken_count + instance->pair_count + 1;
	uint32_t *stack = ARENA_ARRAY(scratch, room, uint32_t);
	uint8_t *seen = ARENA_ZEROED(scratch, (size_t)leaf_limit + instance->pair_count, uint8_t);
	enum tw_status status = stack && seen ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		size_t top = 0;
		uint32_t count = 0;
		for (uint32_t i = 0; i < edge_count; i++)
			stack[top++] = instance->origin[edges[i]];
		for (uint32_t i = 0; i < instance->taken_count; i++)
			stack[top++] = instance->taken[i];
		while (top) {
			assert(top <= room);
			uint32_t origin = stack[--top];
			if (seen[origin])
				continue;
			seen[origin] = 1;
			if (origin < leaf_limit) {
				leaves[count++] = origin;
			} else {
				stack[top++] = instance->pair[origin - leaf_limit][0];
				stack[top++] = instance->pair[origin - leaf_limit][1];
			}
		}
		*leaf_count = count;
	}
	arena_release(scratch, mark);
	return status;
}
