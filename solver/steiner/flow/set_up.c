/* Purpose: set a flow up, and carry it over to a smaller instance. */
#include "solver/steiner/flow/state.h"
#include "solver/steiner/flow/sweep.h"

#include <assert.h>
#include <string.h>

/* Costs below this share of the mean are raised to it: the factor's entries are their inverses, and single precision
 * holds seven digits. The split does not know of it. */
static const double least_share = 1e-4;

/* The factor may have this many entries for a vertex: meshes of 23,500 vertices have 20 to 36 and with chords 90, of
 * 723,000 68; what is not nearly planar has many hundreds and takes longer than it gains. But the factors of small
 * graphs are small, and linear programs of dense ones take minutes for the bound that a flow finds in some tenths of a
 * second (SteinLib's i640-141, 143, 145 after reductions; all pairs of 640 vertices are 204,480 entries). */
enum { ENTRIES_FOR_A_VERTEX = 300, ENTRIES_LEAST = 300000 };

static size_t entries_most(const struct instance *instance)
{
	const size_t entries = (size_t)instance->vertex_count * ENTRIES_FOR_A_VERTEX;
	return entries > ENTRIES_LEAST ? entries : ENTRIES_LEAST;
}

/* The first omega. From 0.05 to 0.2 any did as well at 23,500 vertices; larger meshes want less, as ways have more
 * edges, and parts of a mesh (part.h) more. With 100 terminals, 64 iterations from 0.1, 0.3 and 0.7 on left 0.9, 0.15
 * and 0.13 per cent of a gap on 2,200 vertices; 100 iterations from 0.1, 0.7 and 1.5 on left 0.45, 0.17 and 0.03 on
 * 850. Few terminals want no more than 0.7 there: with 14 on 1,400, 24 iterations from 0.7 on left 0.06 per cent, from
 * 1.5 on 1.4. */
enum { FEW_TERMINALS = 30 };
static const float omega_of_few = 0.7f;

static float omega_of_size(uint32_t vertex_count)
{
	static const struct {
		uint32_t vertices;
		float omega;
	} step[] = {{700, 3.0f}, {2000, 1.5f}, {5000, 0.7f}, {60000, 0.1f}, {400000, 0.05f}};
	for (uint32_t i = 0; i < sizeof step / sizeof *step; i++)
		if (vertex_count < step[i].vertices)
			return step[i].omega;
	return 0.02f;
}

/* The more commodities share an edge, the less of its price is each one's, and the larger omega must be. Measured on
 * 23,500 to 34,000 vertices, to a proof, with iterate.c's larger last omega: 80 and 100 terminals in 0.8 to 1.6 s with
 * 0.2 as with 0.3, with 0.1 and a last omega of 0.7 in 1.1 to 2.0 (a nearly pure length with 100, s23k_wb, takes 5 s
 * and more with any); 200 on a suit in 1.6 s with 0.5, with 0.1 in 5.2; SteinLib's alue7065 (544) in 23 s with 1, with
 * 0.1 not in minutes. More than 1 only small graphs want. */
static float omega_of(const struct instance *instance)
{
	static const struct {
		uint32_t terminals;
		float factor;
	} step[] = {{60, 1}, {150, 2}, {400, 5}, {UINT32_MAX, 10}};
	float of_size = omega_of_size(instance->vertex_count);
	if (instance->terminal_count < FEW_TERMINALS && of_size > omega_of_few)
		of_size = omega_of_few;
	uint32_t i = 0;
	while (instance->terminal_count >= step[i].terminals)
		i++;
	const float omega = of_size * step[i].factor, most = of_size > 1 ? of_size : 1;
	return omega < most ? omega : most;
}

/* A factorisation's operations take 0.1 ns, a unit of work 10. Of a limit of work, this many iterations must be left.
 */
enum { OPERATIONS_FOR_A_UNIT = 100, LEAST_ITERATIONS = 40 };

/* 1.2 GB: 723,000 vertices with 36 terminals take half of it. */
enum { FLOATS_MOST = 300000000 };

static enum tw_status allocate(struct flow *flow, struct arena *arena)
{
	const size_t m = flow->edge_count, n = flow->ldl.place_count, stride = flow->stride;
	flow->ends = ARENA_ARRAY(arena, 2 * m, uint32_t);
	flow->part_edge = ARENA_ARRAY(arena, (size_t)flow->ldl.part_count + 2, uint32_t);
	flow->origin = ARENA_ARRAY(arena, m, uint32_t);
	flow->slot = ARENA_ARRAY(arena, m, uint32_t);
	flow->inverse = ARENA_ARRAY(arena, m, float);
	flow->sink = ARENA_ARRAY(arena, flow->commodity_count, uint32_t);
	flow->price = ARENA_ZEROED(arena, m, struct flow_price);
	flow->z = ARENA_ZEROED(arena, m * stride, float);
	flow->potential = ARENA_ZEROED(arena, n * stride, float);
	flow->next = ARENA_ZEROED(arena, n * stride, float);
	flow->top.value = ARENA_ARRAY(arena, ldl_top_size(&flow->ldl, flow->stride), float);
	flow->split.edge = ARENA_ARRAY(arena, m, struct flow_split_edge);
	flow->split.own = ARENA_ARRAY(arena, SPLIT_BLOCK * m, int32_t);
	return flow->ends && flow->part_edge && flow->origin && flow->slot && flow->inverse && flow->sink &&
			       flow->price && flow->z && flow->potential && flow->next && flow->top.value &&
			       flow->split.edge && flow->split.own
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

/* Edges by the place of the end that comes first; next[place] counts, then fills. An edge between a part and the top
 * belongs to the part, and ends at its copy. */
static void sort_edges(struct flow *flow, const struct instance *instance, uint32_t *next)
{
	const uint32_t *const rank = flow->ldl.rank;
	for (uint32_t e = 0; e < flow->edge_count; e++) {
		const uint32_t u = rank[instance->ends[2 * e]], v = rank[instance->ends[2 * e + 1]];
		next[(u < v ? u : v) + 1]++;
	}
	for (uint32_t p = 0; p < flow->ldl.place_count; p++)
		next[p + 1] += next[p];
	for (uint32_t part = 0; part <= flow->ldl.part_count; part++)
		flow->part_edge[part] = next[flow->ldl.part[part].first];
	flow->part_edge[flow->ldl.part_count + 1] = flow->edge_count;
	for (uint32_t e = 0; e < flow->edge_count; e++) {
		const uint32_t u = rank[instance->ends[2 * e]], v = rank[instance->ends[2 * e + 1]];
		const uint32_t slot = next[u < v ? u : v]++, part = ldl_part_of(&flow->ldl, u < v ? u : v);
		flow->ends[2 * slot] = ldl_place_in(&flow->ldl, part, u);
		flow->ends[2 * slot + 1] = ldl_place_in(&flow->ldl, part, v);
		flow->slot[e] = slot;
	}
}

static enum tw_status order_edges(struct flow *flow, struct search *search)
{
	const struct arena_mark mark = arena_mark(search->arena);
	uint32_t *next = ARENA_ZEROED(search->arena, (size_t)flow->ldl.place_count + 1, uint32_t);
	if (next)
		sort_edges(flow, &search->instance, next);
	arena_release(search->arena, mark);
	memcpy(flow->origin, search->instance.origin, flow->edge_count * sizeof *flow->origin);
	return next ? TW_OK : TW_ERROR_MEMORY;
}

static bool count_work(void *search, uint64_t operations)
{
	return search_spend(search, operations / OPERATIONS_FOR_A_UNIT);
}

static enum tw_status factorise(struct flow *flow, struct search *search, const struct ldl_graph *graph,
				const struct dual *dual)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	double *weight = ARENA_ARRAY(search->arena, flow->edge_count, double), sum = 0;
	enum tw_status status = weight ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (uint32_t e = 0; e < flow->edge_count; e++)
			sum += coarse_of(instance->weight[e], dual->coarse_shift);
		const double least = sum > 0 ? sum / flow->edge_count * least_share : 1;
		for (uint32_t e = 0; e < flow->edge_count; e++) {
			const double cost = coarse_of(instance->weight[e], dual->coarse_shift);
			weight[e] = 1 / (cost > least ? cost : least);
			flow->inverse[flow->slot[e]] = (float)weight[e];
		}
		status = ldl_factorise(&flow->ldl, search->arena, graph, weight, instance->terminal[flow->root],
				       count_work, search);
	}
	arena_release(search->arena, mark);
	return status;
}

/* Whether the matrices may be had: no more than half of the memory that is left, since the dynamic program wants some,
 * too. */
static bool fits(const struct flow *flow, const struct search *search)
{
	const size_t floats = ((size_t)flow->edge_count + 2 * (size_t)flow->vertex_count) * flow->stride;
	const size_t limit = search->options->memory_limit, used = arena_used(search->arena);
	return floats <= FLOATS_MOST && (!limit || (used < limit && floats * sizeof(float) <= (limit - used) / 2));
}

/* Whether a search with a limit of work lives to see a bound. */
static bool pays(const struct flow *flow, const struct search *search)
{
	const uint64_t limit = search->options->work_limit, factor = flow->ldl.operations / OPERATIONS_FOR_A_UNIT;
	return !limit || search->work + factor + LEAST_ITERATIONS * flow_work(flow) < limit;
}

static enum tw_status set_up(struct flow *flow, struct search *search, const struct dual *dual)
{
	const struct instance *instance = &search->instance;
	const struct ldl_graph graph = {instance->vertex_count, instance->edge_count, instance->ends};
	*flow = (struct flow){
		.vertex_count = instance->vertex_count,
		.edge_count = instance->edge_count,
		.root = dual->root,
		.commodity_count = instance->terminal_count - 1,
		.stride = lanes_padded(instance->terminal_count - 1),
		.omega = omega_of(instance),
	};
	if (!fits(flow, search))
		return TW_ERROR_MEMORY;
	enum tw_status status = ldl_analyse(&flow->ldl, search->arena, &graph, entries_most(instance));
	if (status == TW_OK && !pays(flow, search))
		status = TW_ERROR_LIMIT;
	if (status == TW_OK)
		status = allocate(flow, search->arena);
	if (status == TW_OK)
		status = order_edges(flow, search);
	if (status == TW_OK)
		status = factorise(flow, search, &graph, dual);
	flow->ground = status == TW_OK ? flow->ldl.rank[instance->terminal[flow->root]] : 0;
	for (uint32_t i = 0; i < flow->commodity_count && status == TW_OK; i++)
		flow->sink[i] = flow->ldl.rank[instance->terminal[flow_terminal(flow, i)]];
	search->work += flow->edge_count;
	return status;
}

/* A failure leaves nothing behind. */
static enum tw_status set_up_new(struct flow **flow, struct search *search, const struct dual *dual)
{
	const struct arena_mark mark = arena_mark(search->arena);
	struct flow *new = ARENA_ARRAY(search->arena, 1, struct flow);
	const enum tw_status status = new ? set_up(new, search, dual) : TW_ERROR_MEMORY;
	if (status == TW_OK)
		*flow = new;
	else
		arena_release(search->arena, mark);
	return status;
}

enum tw_status flow_new(struct flow **flow, struct search *search, const struct dual *dual)
{
	*flow = NULL;
	return set_up_new(flow, search, dual);
}

enum tw_status flow_shrink(struct flow **flow, struct search *search, const struct dual *dual)
{
	const struct flow *old = *flow;
	struct flow *new;
	const enum tw_status status = set_up_new(&new, search, dual);
	if (status != TW_OK)
		return status;
	assert(new->root == old->root &&new->stride == old->stride);
	new->omega = old->omega;
	new->iteration = old->iteration;
	for (uint32_t e = 0, i = 0; e < new->edge_count; e++, i++) {
		while (old->origin[i] != new->origin[e])
			i++;
		assert(i < old->edge_count);
		const size_t to = new->slot[e], from = old->slot[i], row = new->stride;
		memcpy(new->z + to *row, old->z + from * row, row * sizeof *new->z);
		new->price[to] = old->price[from];
	}
	flow_restore(new);
	*flow = new;
	return TW_OK;
}

uint32_t flow_edges(const struct flow *flow)
{
	return flow->edge_count;
}

uint64_t flow_split_work(const struct flow *flow)
{
	return (uint64_t)flow->commodity_count * (flow->edge_count + 4 * (uint64_t)flow->vertex_count);
}

/* A ball that reaches the root holds about half of the graph. */
size_t flow_members(const struct flow *flow)
{
	return (size_t)flow->vertex_count * flow->commodity_count / 2;
}
