/* Purpose: keep a flow by the names of its edges' ends, and start another one from it.
 *
 * A terminal that moved takes over the flow of one that is gone, the nearest: most of the way is the same, and the
 * iterations turn the rest round. */
#include "solver/steiner/warm/memory.h"

#include "solver/steiner/flow/carry.h"

#include <string.h>

/* Edges by the row of their lower end. */
struct warm_memory {
	uint32_t edge_count, stride;
	uint32_t *first;   /* [rows of the state + 1] */
	uint32_t *head;    /* [edge_count] row of the higher end */
	float *z;          /* [edge_count * stride] for each lane, from the lower end to the higher */
	float (*price)[2]; /* [edge_count] that way, and back */
	struct flow_pace pace;
};

static bool allocate(struct warm_memory *memory, struct arena *arena, size_t rows)
{
	memory->first = ARENA_ZEROED(arena, rows + 2, uint32_t);
	memory->head = ARENA_ARRAY(arena, memory->edge_count, uint32_t);
	memory->z = ARENA_ARRAY(arena, (size_t)memory->edge_count * memory->stride, float);
	memory->price = arena_array(arena, memory->edge_count, sizeof *memory->price);
	return memory->first && memory->head && memory->z && memory->price;
}

static void store(struct warm_memory *memory, uint32_t at, const struct flow_seed *seed, bool is_turned)
{
	float *z = memory->z + (size_t)at * memory->stride;
	for (uint32_t i = 0; i < memory->stride; i++)
		z[i] = is_turned ? -seed->z[i] : seed->z[i];
	memory->price[at][is_turned] = seed->forward;
	memory->price[at][!is_turned] = seed->backward;
}

void warm_memory_keep(struct steiner_warm *warm, const struct search *search, const struct flow *flow,
		      const uint32_t *vertex_of)
{
	const struct instance *instance = &search->instance;
	const size_t rows = (size_t)warm->lasting_count + warm->extra_count;
	const struct arena_mark mark = arena_mark(warm->arena);
	struct warm_memory *memory = ARENA_ARRAY(warm->arena, 1, struct warm_memory);
	if (!memory)
		return;
	*memory = (struct warm_memory){
		.edge_count = instance->edge_count, .stride = warm->lane_count, .pace = flow_pace_of(flow)};
	if (!allocate(memory, warm->arena, rows)) {
		arena_release(warm->arena, mark);
		return;
	}
	uint32_t *next = memory->first + 1; /* becomes first[row] when all edges are in */
	for (uint32_t pass = 0; pass < 2; pass++) {
		for (uint32_t e = 0; e < instance->edge_count; e++) {
			const uint32_t u = vertex_of[instance->ends[2 * (size_t)e]];
			const uint32_t v = vertex_of[instance->ends[2 * (size_t)e + 1]], low = u < v ? u : v;
			if (!pass) {
				next[low + 1]++;
				continue;
			}
			const uint32_t at = next[low]++;
			const struct flow_seed seed = flow_seed_of(flow, e);
			memory->head[at] = u < v ? v : u;
			store(memory, at, &seed, u > v);
		}
		for (size_t r = 0; r < rows && !pass; r++)
			next[r + 1] += next[r];
	}
	warm->memory = memory;
}

static uint32_t find_edge(const struct warm_memory *memory, uint32_t low, uint32_t high)
{
	for (uint32_t at = memory->first[low]; at < memory->first[low + 1]; at++)
		if (memory->head[at] == high)
			return at;
	return INSTANCE_NONE;
}

/* The lane whose flow each commodity begins with; INSTANCE_NONE: none. */
static void match_lanes(const struct warm_lanes *lanes, const struct search *search, const struct flow *flow,
			uint32_t *lane_of)
{
	for (uint32_t i = 0; i + 1 < search->instance.terminal_count; i++)
		lane_of[i] = lanes->flow_of[flow_terminal_of(flow, i)];
}

static void take(const struct warm_memory *memory, uint32_t at, const uint32_t *lane_of, uint32_t count, bool is_turned,
		 float *z)
{
	const float *from = memory->z + (size_t)at * memory->stride;
	for (uint32_t i = 0; i < count; i++) {
		const float value = lane_of[i] == INSTANCE_NONE ? 0 : from[lane_of[i]];
		z[i] = is_turned ? -value : value;
	}
}

enum tw_status warm_memory_start(const struct warm_lanes *lanes, struct search *search, struct flow *flow,
				 bool *has_started)
{
	const struct warm_memory *memory = lanes->warm->memory;
	const struct instance *instance = &search->instance;
	const uint32_t commodities = instance->terminal_count - 1;
	*has_started = memory != NULL;
	if (!memory)
		return TW_OK;
	const struct arena_mark mark = arena_mark(search->arena);
	uint32_t *vertex_of = ARENA_ARRAY(search->arena, instance->vertex_count, uint32_t);
	uint32_t *row_of = ARENA_ARRAY(search->arena, instance->vertex_count, uint32_t);
	uint32_t *lane_of = ARENA_ARRAY(search->arena, commodities, uint32_t);
	float *z = ARENA_ARRAY(search->arena, commodities, float);
	if (!vertex_of || !row_of || !lane_of || !z)
		return TW_ERROR_MEMORY;
	warm_name_vertices(search, vertex_of);
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		row_of[v] = warm_row_of(lanes->warm, warm_key_of(search, vertex_of[v]));
	match_lanes(lanes, search, flow, lane_of);
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		const uint32_t u = row_of[instance->ends[2 * (size_t)e]], v = row_of[instance->ends[2 * (size_t)e + 1]];
		const uint32_t at = u == INSTANCE_NONE || v == INSTANCE_NONE ? INSTANCE_NONE
				    : u < v                                  ? find_edge(memory, u, v)
									     : find_edge(memory, v, u);
		if (at == INSTANCE_NONE)
			continue;
		const bool is_turned = u > v;
		take(memory, at, lane_of, commodities, is_turned, z);
		const struct flow_seed seed = {z, memory->price[at][is_turned], memory->price[at][!is_turned]};
		flow_sow(flow, e, &seed);
	}
	flow_resume(flow, memory->pace);
	search->work += (uint64_t)instance->edge_count * (1 + commodities / 32);
	arena_release(search->arena, mark);
	return TW_OK;
}
