/* Purpose: find where the dual loses. */
#include "solver/steiner/dual/fault.h"

#include "solver/steiner/dual/ball.h"

#include <assert.h>
#include <string.h>

enum tw_status dual_faults_allocate(struct dual_faults **faults, struct search *search)
{
	struct dual_faults *new = ARENA_ARRAY(search->arena, 1, struct dual_faults);
	if (!new)
		return TW_ERROR_MEMORY;
	const size_t capacity = search->instance.vertex_count + 16 * (size_t)search->instance.terminal_count;
	*new = (struct dual_faults){
		.fault = ARENA_ARRAY(search->arena, capacity, struct dual_fault),
		.capacity = (uint32_t)capacity,
	};
	*faults = new;
	return new->fault ? TW_OK : TW_ERROR_MEMORY;
}

static void add_fault(struct dual *dual, uint64_t loss, uint32_t terminal, uint64_t level)
{
	if (!loss || terminal == INSTANCE_NONE || dual->faults->count == dual->faults->capacity)
		return;
	dual->faults->fault[dual->faults->count++] = (struct dual_fault){loss, level, terminal};
	dual->faults->sum += loss;
}

/* The length of the guide inside the ball beyond its radius. */
static uint64_t excess_of(const struct dual *dual, const struct dual_ball *ball)
{
	const struct dual_member *member = dual->member + ball->start;
	const uint32_t *parent = dual->guide.parent;
	uint32_t *distance = dual->distance;
	uint64_t length = 0;
	for (uint32_t i = 0; i < ball->count; i++)
		distance[member[i].vertex] = member[i].distance;
	for (uint32_t i = 0; i < ball->count; i++) {
		const uint32_t v = member[i].vertex, d = member[i].distance;
		if (parent[v] == INSTANCE_NONE)
			continue;
		const uint32_t outer = distance[parent[v]] < ball->radius ? distance[parent[v]] : ball->radius;
		length += outer > d ? outer - d : 0;
	}
	for (uint32_t i = 0; i < ball->count; i++)
		distance[member[i].vertex] = UINT32_MAX;
	return length > ball->radius ? length - ball->radius : 0;
}

/* A terminal at or below the vertex in the guide; INSTANCE_NONE at a bare end, which reductions may leave. */
static uint32_t terminal_below(struct dual *dual, uint32_t v)
{
	const struct instance *instance = dual->instance;
	while (instance->terminal_at[v] == INSTANCE_NONE) {
		const uint32_t first = dual->guide.first[v], degree = dual->guide.first[v + 1] - first;
		if (degree < 2)
			return INSTANCE_NONE;
		uint32_t child = dual->guide.next[first + (uint32_t)dual_draw(dual, degree)];
		if (child == dual->guide.parent[v]) /* the next in the row is none */
			child = dual->guide.next[first + (child == dual->guide.next[first])];
		v = child;
	}
	return instance->terminal_at[v];
}

void dual_find_faults(struct dual *dual, struct search *search)
{
	const struct instance *instance = dual->instance;
	uint64_t *inner = dual->inner, work = 0;
	dual->faults->count = 0;
	dual->faults->sum = 0;
	memset(inner, 0, instance->terminal_count * sizeof *inner);
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		if (!ball->applied || ball->terminal == INSTANCE_NONE)
			continue;
		add_fault(dual, excess_of(dual, ball), ball->terminal, inner[ball->terminal]);
		inner[ball->terminal] += ball->radius;
		work += ball->count;
	}
	for (uint32_t i = 1; i < dual->guide.count; i++) {
		const uint32_t v = dual->guide.vertex[i];
		uint32_t a = instance->first[v];
		while (instance->head[a] != dual->guide.parent[v])
			a++;
		if (dual->arc[a].cost)
			add_fault(dual, dual->arc[a].cost, terminal_below(dual, v), UINT64_MAX);
	}
	search->work += work + dual->guide.count;
}
