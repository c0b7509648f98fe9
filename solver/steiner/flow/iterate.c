/* Purpose: iterations: solve for the potentials, sweep over the edges, let omega grow. */
#include "solver/parallel.h"
#include "solver/steiner/flow/state.h"
#include "solver/steiner/flow/sweep.h"

#include <string.h>

/* omega grows by a fifth every ten iterations: small ones find the way, large ones hold the prices together; 0.7 from
 * the start was much slower. */
enum { OMEGA_PERIOD = 10, MANY_TERMINALS = 60 };
static const float omega_growth = 1.2f, omega_last = 0.5f, omega_last_of_many = 0.7f;

/* Units of work: 100 floats of factor and edges take as long as an arc that is looked at, some 10 ns (8 ms for an
 * iteration at 23,500 vertices and 36 terminals). */
enum { FLOATS_FOR_A_UNIT = 100 };

uint64_t flow_work(const struct flow *flow)
{
	return flow->stride * (2 * ldl_entries(&flow->ldl) + 16 * (uint64_t)flow->edge_count) / FLOATS_FOR_A_UNIT + 1;
}

/* Below this much work, some 0.3 ms, threads take longer to start than they save. */
enum { WORK_FOR_THREADS = 30000 };

struct solve {
	const struct ldl *ldl;
	float *x;
	uint32_t stride;
};

/* Columns do not depend on one another. */
static void solve_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	const struct solve *solve = context;
	(void)thread;
	ldl_solve(solve->ldl, solve->x, solve->stride, first * LANES_BLOCK, end * LANES_BLOCK);
}

static void solve_all(struct flow *flow, unsigned threads)
{
	const uint32_t blocks = flow->stride / LANES_BLOCK;
	for (uint32_t i = 0; i < flow->commodity_count; i++)
		flow->next[(size_t)flow->sink[i] * flow->stride + i] -= 1 / flow->omega;
	memset(flow->next + (size_t)flow->ground * flow->stride, 0, flow->stride * sizeof *flow->next);
	float *const x = flow->next;
	flow->next = flow->potential;
	flow->potential = x;
	struct solve solve = {&flow->ldl, x, flow->stride};
	parallel_for(threads, blocks, (blocks + threads - 1) / threads, solve_part, &solve);
}

enum tw_status flow_iterate(struct flow *flow, struct search *search, uint32_t iterations)
{
	const float last = flow->commodity_count < MANY_TERMINALS ? omega_last : omega_last_of_many;
	const unsigned wanted = search->options->threads ? search->options->threads : 1;
	const unsigned threads = flow_work(flow) < WORK_FOR_THREADS ? 1 : wanted;
	for (uint32_t i = 0; i < iterations; i++) {
		solve_all(flow, threads);
		flow->iteration++;
		const bool grows = flow->iteration % OMEGA_PERIOD == 0 && flow->omega < last;
		flow_sweep(flow, grows ? 1 / omega_growth : 1, threads);
		flow->omega *= grows ? omega_growth : 1;
		if (!search_spend(search, flow_work(flow)))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}
