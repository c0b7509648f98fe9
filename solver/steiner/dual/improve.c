/* Purpose: local search on the dual.
 *
 * A few neighbouring terminals give back all they took, or all beyond some level, and grow anew in another order, in
 * coarser or finer turns; what is no worse is kept, so that the search can walk along plateaus. Which terminals: mostly
 * where the guide tells that the bound is lost, sometimes any, because the guide need not be an optimum. */
#include "solver/steiner/dual/ball.h"
#include "solver/steiner/dual/fault.h"

#include <string.h>

enum { GROUP_LEAST = 2, GROUP_USUAL = 6, GROUP_MOST = 24, FAULT_STEPS = 25 };

struct step {
	uint32_t group[GROUP_MOST];
	uint32_t count;
	uint64_t level; /* of their values; balls up to it stay */
};

static void shuffle(struct dual *dual, uint32_t *group, uint32_t count)
{
	for (uint32_t i = count; i > 1; i--) {
		uint32_t j = (uint32_t)dual_draw(dual, i), t = group[i - 1];
		group[i - 1] = group[j];
		group[j] = t;
	}
}

/* The terminal and some of its nearest neighbours; the root stays out. `gaps`: leave out some in between. */
static void gather_around(struct dual *dual, struct step *step, uint32_t centre, int gaps)
{
	const uint32_t most = dual_draw(dual, 32) ? GROUP_USUAL : GROUP_MOST;
	const uint32_t size = GROUP_LEAST + (uint32_t)dual_draw(dual, most - GROUP_LEAST + 1);
	const uint32_t *near = dual->survey->near + (size_t)centre * dual->survey->near_count;
	step->count = 0;
	if (centre != dual->root)
		step->group[step->count++] = centre;
	for (uint32_t i = 0; i < dual->survey->near_count && step->count < size; i++)
		if (near[i] != dual->root && (!gaps || dual_draw(dual, 2)))
			step->group[step->count++] = near[i];
}

static int belongs(const struct dual_ball *ball, const uint32_t *group, uint32_t count)
{
	for (uint32_t i = 0; i < count; i++)
		if (ball->terminal == group[i])
			return 1;
	return 0;
}

/* The value of one of the terminal's balls together with those inside it, but the last: a level at which to cut it
 * back. */
static uint64_t pick_level(struct dual *dual, uint32_t terminal)
{
	uint32_t balls = 0;
	uint64_t level = 0;
	for (uint32_t b = 0; b < dual->ball_count; b++)
		balls += dual->ball[b].applied && dual->ball[b].terminal == terminal;
	uint64_t kept = balls > 1 ? dual_draw(dual, balls) : 0;
	for (uint32_t b = 0; b < dual->ball_count && kept; b++)
		if (dual->ball[b].applied && dual->ball[b].terminal == terminal) {
			level += dual->ball[b].radius;
			kept--;
		}
	return level;
}

/* Begins a step: takes out the group's balls beyond the level; they stay remembered. Balls share no cost, so that any
 * of them may stay. */
static void cut_back(struct dual *dual, struct search *search, const struct step *step)
{
	for (uint32_t i = 0; i < step->count; i++)
		dual->inner[step->group[i]] = 0;
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		struct dual_ball *ball = &dual->ball[b];
		ball->is_new = false;
		if (!ball->applied || !belongs(ball, step->group, step->count))
			continue;
		dual->inner[ball->terminal] += ball->radius;
		if (dual->inner[ball->terminal] > step->level)
			dual_take_out(dual, search, ball);
	}
}

/* Chooses between the balls that were taken out and those of this step. */
static void settle_on(struct dual *dual, struct search *search, int new)
{
	for (uint32_t b = 0; b < dual->ball_count && !new; b++)
		if (dual->ball[b].applied && dual->ball[b].is_new) {
			dual_take_out(dual, search, &dual->ball[b]);
			dual->ball[b].terminal = INSTANCE_NONE;
		}
	for (uint32_t b = 0; b < dual->ball_count; b++)
		if (!dual->ball[b].applied && dual->ball[b].terminal != INSTANCE_NONE) {
			if (new)
				dual->ball[b].terminal = INSTANCE_NONE;
			else
				dual_put_back(dual, search, &dual->ball[b]);
		}
}

static void choose_anywhere(struct dual *dual, struct step *step)
{
	gather_around(dual, step, (uint32_t)dual_draw(dual, dual->instance->terminal_count), 0);
	if (step->count && dual_draw(dual, 2))
		step->level = pick_level(dual, step->group[dual_draw(dual, step->count)]);
}

/* At a fault, the likelier the more it loses. */
static void choose_fault(struct dual *dual, struct step *step)
{
	uint64_t at = dual_draw(dual, dual->faults->sum);
	const struct dual_fault *fault = dual->faults->fault;
	while (at >= fault->loss)
		at -= fault++->loss;
	gather_around(dual, step, fault->terminal, (int)dual_draw(dual, 2));
	if (fault->level != UINT64_MAX && dual_draw(dual, 2))
		step->level = fault->level;
	else if (step->count && dual_draw(dual, 2))
		step->level = pick_level(dual, step->group[dual_draw(dual, step->count)]);
}

/* One step of the local search; *gained: the bound rose. */
static enum tw_status try_step(struct dual *dual, struct search *search, int *gained)
{
	static const unsigned factors[] = {130, 150, 200, 300, 300, 1000};
	struct step step = {0};
	if (dual->faults->sum && dual_draw(dual, 4))
		choose_fault(dual, &step);
	else
		choose_anywhere(dual, &step);
	const uint64_t before = dual->bound;
	uint64_t least = 2 * step.level;
	for (uint32_t i = 0; i < step.count && !step.level; i++)
		if (!i || dual->survey->near_distance[step.group[i]] < least)
			least = dual->survey->near_distance[step.group[i]];
	cut_back(dual, search, &step);
	shuffle(dual, step.group, step.count);
	const int guided = dual_draw(dual, 8) > 0;
	const enum tw_status status = dual_ascend_group(dual, search, step.group, step.count, least / 2 + 1,
							factors[dual_draw(dual, 6)], guided);
	*gained = dual->bound > before;
	settle_on(dual, search, dual->bound >= before);
	search->work += dual->ball_count / 8 + 1;
	return status;
}

enum tw_status dual_improve(struct dual *dual, struct search *search, uint64_t effort, fine_t target)
{
	const uint64_t end = search->work + effort;
	enum tw_status status = dual_guide_set(&dual->guide, search, dual->instance->terminal[dual->root]);
	dual->faults->count = 0;
	dual->faults->sum = 0;
	uint32_t steps = 0;
	int gained = 0;
	while (status == TW_OK && search->work < end && dual_fine_bound(dual) < target) {
		if (dual->guide.count && (gained || steps++ % FAULT_STEPS == 0))
			dual_find_faults(dual, search);
		status = try_step(dual, search, &gained);
	}
	return status;
}
