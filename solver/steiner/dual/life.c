/* Purpose: set a dual up, carry it over to a smaller instance, ask it for distances. */
#include "solver/steiner/dual/dual.h"

#include "solver/splitmix.h"
#include "solver/steiner/dual/ball.h"
#include "solver/steiner/dual/fault.h"

#include <assert.h>
#include <string.h>

uint64_t dual_draw(struct dual *dual, uint64_t below)
{
	const uint64_t number = splitmix(dual->random);
	dual->random += SPLITMIX_STEP;
	return number % below;
}

static void fill_arcs(struct dual *dual)
{
	const struct instance *instance = dual->instance;
	size_t arcs = 2 * (size_t)instance->edge_count;
	uint32_t *side = dual->stack; /* the first arc seen of each edge */
	memset(side, 0xff, instance->edge_count * sizeof *side);
	for (uint32_t a = 0; a < arcs; a++) {
		uint32_t e = instance->edge[a];
		dual->arc[a] = (struct dual_arc){instance->head[a], coarse_of(instance->weight[e], dual->coarse_shift)};
		if (side[e] == INSTANCE_NONE) {
			side[e] = a;
		} else {
			dual->mate[a] = side[e];
			dual->mate[side[e]] = a;
		}
	}
}

static uint64_t mean_cost(const struct dual *dual)
{
	const size_t arcs = 2 * (size_t)dual->instance->edge_count;
	uint64_t sum = 0;
	for (size_t a = 0; a < arcs; a++)
		sum += dual->arc[a].cost;
	return arcs ? sum / arcs : 0;
}

static enum tw_status allocate(struct dual *dual, struct search *search, size_t member_room)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	size_t n = instance->vertex_count, arcs = 2 * (size_t)instance->edge_count, k = instance->terminal_count;
	dual->arena = arena;
	dual->instance = instance;
	dual->value = ARENA_ZEROED(arena, k, uint64_t);
	dual->arc = ARENA_ARRAY(arena, arcs, struct dual_arc);
	dual->mate = ARENA_ARRAY(arena, arcs, uint32_t);
	dual->distance = ARENA_ARRAY(arena, n, uint32_t);
	dual->queue = ARENA_ARRAY(arena, 1, struct dual_queue);
	dual->stack = ARENA_ARRAY(arena, arcs + k, uint32_t);
	dual->inside = ARENA_ZEROED(arena, n, uint8_t);
	dual->inner = ARENA_ARRAY(arena, k, uint64_t);
	dual->ball_capacity = (uint32_t)(16 * k + 64);
	dual->ball = ARENA_ARRAY(arena, dual->ball_capacity, struct dual_ball);
	dual->member_capacity = 4 * n + member_room;
	dual->member = ARENA_ARRAY(arena, dual->member_capacity, struct dual_member);
	if (!dual->value || !dual->arc || !dual->mate || !dual->distance || !dual->queue || !dual->stack ||
	    !dual->inside || !dual->inner || !dual->ball || !dual->member)
		return TW_ERROR_MEMORY;
	memset(dual->distance, 0xff, n * sizeof *dual->distance);
	fill_arcs(dual);
	enum tw_status status = queue_init(dual->queue, arena, arcs + k, mean_cost(dual));
	if (status == TW_OK)
		status = dual_guide_allocate(&dual->guide, search);
	return status == TW_OK ? dual_faults_allocate(&dual->faults, search) : status;
}

enum tw_status dual_init(struct dual *dual, struct search *search)
{
	assert(search->instance.terminal_count > 1);
	*dual = (struct dual){.random = 1};
	while (search_cutoff(search) >> dual->coarse_shift >= DUAL_FAR)
		dual->coarse_shift++;
	struct dual_survey *survey = ARENA_ARRAY(search->arena, 1, struct dual_survey);
	if (!survey)
		return TW_ERROR_MEMORY;
	dual->survey = survey;
	const enum tw_status status = dual_survey_make(survey, search, dual->coarse_shift);
	return status == TW_OK ? allocate(dual, search, 0) : status;
}

enum tw_status dual_init_like(struct dual *dual, struct search *search, const struct dual *from, size_t members)
{
	*dual = (struct dual){
		.root = from->root, .random = 1, .coarse_shift = from->coarse_shift, .survey = from->survey};
	return allocate(dual, search, members);
}

enum tw_status dual_restart(struct dual *dual, struct search *search, uint32_t root)
{
	const struct instance *instance = dual->instance;
	dual->root = root;
	dual->bound = 0;
	dual->ball_count = 0;
	dual->member_count = 0;
	memset(dual->value, 0, instance->terminal_count * sizeof *dual->value);
	for (size_t a = 0; a < 2 * (size_t)instance->edge_count; a++)
		dual->arc[a].cost = coarse_of(instance->weight[instance->edge[a]], dual->coarse_shift);
	search->work += instance->edge_count / 4;
	return dual_guide_set(&dual->guide, search, instance->terminal[root]);
}

void dual_from_root(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *from_root)
{
	const struct instance *instance = dual->instance;
	struct dual_queue *queue = dual->queue;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		from_root[v] = DUAL_FAR;
	from_root[instance->terminal[dual->root]] = 0;
	queue_push(queue, instance->terminal[dual->root]);
	for (uint64_t key; queue_pop(queue, from_root, &key);) {
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[dual->mate[a]].cost;
			if (longer >= from_root[u] || longer >= limit)
				continue;
			from_root[u] = longer;
			queue_push(queue, (uint64_t)longer << 32 | u);
		}
	}
	search->work += 2 * instance->edge_count;
}

void dual_to_terminal(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *to_terminal)
{
	const struct instance *instance = dual->instance;
	struct dual_queue *queue = dual->queue;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		to_terminal[v] = DUAL_FAR;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (t != dual->root) {
			to_terminal[instance->terminal[t]] = 0;
			queue_push(queue, instance->terminal[t]);
		}
	for (uint64_t key; queue_pop(queue, to_terminal, &key);) {
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[a].cost;
			if (longer >= to_terminal[u] || longer >= limit)
				continue;
			to_terminal[u] = longer;
			queue_push(queue, (uint64_t)longer << 32 | u);
		}
	}
	search->work += 2 * instance->edge_count;
}

enum tw_status dual_transfer(struct dual *dual, struct search *search, const struct dual *from, const uint32_t *number)
{
	*dual = (struct dual){
		.root = from->root, .random = from->random, .coarse_shift = from->coarse_shift, .survey = from->survey};
	enum tw_status status = allocate(dual, search, from->member_count);
	if (status != TW_OK)
		return status;
	for (uint32_t b = 0; b < from->ball_count; b++) {
		const struct dual_member *member = from->member + from->ball[b].start;
		struct dual_ball ball = from->ball[b];
		if (!ball.applied)
			continue;
		/* Before the members are written: making room keeps only those of balls that are listed. */
		if (dual->ball_count == dual->ball_capacity && !dual_make_room(dual))
			return TW_ERROR_MEMORY;
		assert(dual->member_count + ball.count <= dual->member_capacity);
		ball.applied = false;
		ball.start = dual->member_count;
		ball.count = 0;
		for (uint32_t i = 0; i < from->ball[b].count; i++) {
			uint32_t v = number[member[i].vertex];
			if (v != INSTANCE_NONE)
				dual->member[ball.start + ball.count++] = (struct dual_member){v, member[i].distance};
		}
		dual->member_count += ball.count;
		dual->ball[dual->ball_count++] = ball;
		dual_put_back(dual, search, &dual->ball[dual->ball_count - 1]);
	}
	return TW_OK;
}
