/* Purpose: iterations: solve for the potentials, sweep over the edges, let omega grow. */
#include "solver/parallel.h"
#include "solver/steiner/flow/state.h"
#include "solver/steiner/flow/sweep.h"

#include <string.h>

/* omega grows by a fifth every ten iterations: small ones find the way, large ones hold the prices together; 0.7 from
 * the start was much slower. Where many terminals begin with more (set_up.c), they end with more, too: 80 terminals on
 * a suit took 1.1 s with 0.7 and 0.8 with 2, alue7065 was not proven in 24 s with 8, but in 23 with 16. */
enum { OMEGA_PERIOD = 10, MANY_TERMINALS = 60, VERY_MANY_TERMINALS = 400 };
static const float omega_growth = 1.2f, omega_last = 0.5f, omega_last_of_many = 2, omega_last_of_very_many = 16;

/* Units of work: 300 floats of factor and edges take as long as an arc that is looked at, some 10 ns (with AVX2, 2.3 ms
 * for an iteration at 23,500 vertices and 36 terminals; with SSE2 twice as long). */
enum { FLOATS_FOR_A_UNIT = 300 };

uint64_t flow_work(const struct flow *flow)
{
	return flow->stride * (2 * (uint64_t)flow->ldl.value_count + 16 * (uint64_t)flow->edge_count) /
		       FLOATS_FOR_A_UNIT +
	       1;
}

/* Below this much work, some 0.1 ms, threads take longer to start than they save. */
enum { WORK_FOR_THREADS = 10000 };

/* Two loops take turns. In one, each part by itself: the second half of a solve, the sweep over the part's edges, and
 * the first half of the next solve, while its rows are in the cache; in the other, the solve in the top. */
struct turn {
	struct flow *flow;
	bool ends, begins; /* whether an iteration is ended, and another one begun */
	float shrink;
	float omega; /* of the iteration that is begun */
};

/* The right-hand side's other term, and nothing at the ground and its copies. */
static void complete_rows(struct flow *flow, const struct ldl_part *part, float omega)
{
	float *const next = flow->next;
	const size_t stride = flow->stride;
	for (uint32_t i = 0; i < flow->commodity_count; i++)
		if (flow->sink[i] >= part->first && flow->sink[i] < part->end)
			next[flow->sink[i] * stride + i] -= 1 / omega;
	if (flow->ground >= part->first && flow->ground < part->end)
		memset(next + flow->ground * stride, 0, stride * sizeof *next);
	for (uint32_t place = part->end; place < part->copies_end; place++)
		if (flow->ldl.original[place] == flow->ground)
			memset(next + place * stride, 0, stride * sizeof *next);
}

static void turn_part(const struct turn *turn, uint32_t part)
{
	struct flow *const flow = turn->flow;
	const bool is_top = part == flow->ldl.part_count;
	if (turn->ends) {
		ldl_backward(&flow->ldl, flow->potential, &flow->top, flow->stride, part);
		flow_sweep(flow, part, turn->shrink);
	}
	if (turn->begins)
		complete_rows(flow, &flow->ldl.part[part], turn->omega);
	if (turn->begins && !is_top)
		ldl_forward(&flow->ldl, flow->next, flow->stride, part);
}

static void turn_parts(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	(void)thread;
	for (uint32_t part = first; part < end; part++)
		turn_part(context, part);
}

static void solve_chunks(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	const struct flow *const flow = ((const struct turn *)context)->flow;
	(void)thread;
	for (uint32_t chunk = first; chunk < end; chunk++)
		ldl_solve_top(&flow->ldl, flow->potential, &flow->top, flow->stride, chunk);
}

/* The new right-hand side becomes the potentials. */
static void solve_top(struct turn *turn, struct parallel_team *team)
{
	struct flow *const flow = turn->flow;
	float *const x = flow->next;
	flow->next = flow->potential;
	flow->potential = x;
	parallel_team_for(team, (flow->stride + flow->top.width - 1) / flow->top.width, 1, solve_chunks, turn);
}

static enum tw_status iterate(struct flow *flow, struct search *search, uint32_t iterations, struct parallel_team *team)
{
	const float last = flow->commodity_count < MANY_TERMINALS        ? omega_last
			   : flow->commodity_count < VERY_MANY_TERMINALS ? omega_last_of_many
									 : omega_last_of_very_many;
	const uint32_t parts = flow->ldl.part_count + 1;
	struct turn turn = {.flow = flow, .begins = true, .omega = flow->omega};
	parallel_team_for(team, parts, 1, turn_parts, &turn);
	turn.ends = true;
	for (uint32_t i = 0; i < iterations; i++) {
		const bool goes_on = search_spend(search, flow_work(flow));
		solve_top(&turn, team);
		flow->iteration++;
		const bool grows = flow->iteration % OMEGA_PERIOD == 0 && flow->omega < last;
		flow->omega *= grows ? omega_growth : 1;
		turn.omega = flow->omega;
		turn.shrink = grows ? 1 / omega_growth : 1;
		turn.begins = goes_on && i + 1 < iterations;
		parallel_team_for(team, parts, 1, turn_parts, &turn);
		if (!goes_on)
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

enum tw_status flow_iterate(struct flow *flow, struct search *search, uint32_t iterations)
{
	const unsigned wanted = search->options->threads ? search->options->threads : 1;
	const unsigned threads = flow_work(flow) < WORK_FOR_THREADS ? 1 : wanted;
	if (!iterations)
		return TW_OK;
	const uint32_t blocks = flow->stride / LANES_BLOCK;
	flow->top.width = (blocks + threads - 1) / threads * LANES_BLOCK;
	struct parallel_team *const team = parallel_team_new(threads);
	const enum tw_status status = iterate(flow, search, iterations, team);
	parallel_team_free(team);
	return status;
}
