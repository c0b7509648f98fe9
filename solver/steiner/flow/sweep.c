/* Purpose: over-relaxation, projection, and the next right-hand side, in one pass over the edges.
 *
 * With d = (p(u) - p(v)) / c for all commodities of an edge: z <- alpha d + (1 - alpha) w + u, where w and u are those
 * of the old z; then w = proj_K(z). The positive and the negative parts are projected apart: where they sum to more
 * than 1, each gives up the same mu, but none more than it has. mu is the root of a convex piecewise linear function,
 * found by Newton's method from the last value (each step: the sum of those above mu, less 1, over their number); it
 * comes from below after the first step, so that stopping early leaves a little more than 1, which flow_split cuts off.
 */
#include "solver/steiner/flow/sweep.h"

#include "solver/parallel.h"

#include <assert.h>
#include <string.h>

/* 1.8 is ADMM's usual over-relaxation. Two Newton steps a sweep: one leaves mu behind when many commodities meet, a
 * third changes nothing after the first iterations. */
static const float relaxation = 1.8f;
enum { NEWTON_STEPS = 2 };

/* What is above the two prices: sums and numbers. */
struct above {
	lanes sum_forward, sum_backward, count_forward, count_backward;
};

static inline void count_above(struct above *above, lanes z, struct flow_price price)
{
	const lanes one = lanes_of(1);
	const lanes_mask forward = z > lanes_of(price.forward), backward = z < lanes_of(-price.backward);
	above->sum_forward += lanes_where(forward, z);
	above->sum_backward -= lanes_where(backward, z);
	above->count_forward += lanes_where(forward, one);
	above->count_backward += lanes_where(backward, one);
}

static inline float newton(lanes sum, lanes count)
{
	const float excess = lanes_sum(sum) - 1, number = lanes_sum(count);
	return excess > 0 ? excess / number : 0;
}

static struct flow_price project(const lanes *z, uint32_t vectors, struct flow_price price)
{
	for (unsigned step = 0; step < NEWTON_STEPS; step++) {
		struct above a = {0}, b = {0};
		for (uint32_t i = 0; i < vectors; i += 2) {
			count_above(&a, z[i], price);
			count_above(&b, z[i + 1], price);
		}
		price.forward = newton(a.sum_forward + b.sum_forward, a.count_forward + b.count_forward);
		price.backward = newton(a.sum_backward + b.sum_backward, a.count_backward + b.count_backward);
	}
	return price;
}

/* z of one edge. */
static inline void relax(lanes *z, const lanes *u, const lanes *v, uint32_t vectors, float inverse,
			 struct flow_price price)
{
	const lanes scale = lanes_of(relaxation * inverse), keep = lanes_of(1 - relaxation),
		    less = lanes_of(relaxation);
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	for (uint32_t i = 0; i < vectors; i++) {
		const lanes part = lanes_clamp(z[i], least, most);
		/* (1 - alpha) (z - part) + part */
		z[i] = scale * (u[i] - v[i]) + keep * z[i] + less * part;
	}
}

/* u becomes shrink * u, and with it z = w + u. */
static inline struct flow_price settle(lanes *z, uint32_t vectors, struct flow_price price, float shrink)
{
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward), factor = lanes_of(shrink);
	for (uint32_t i = 0; i < vectors; i++) {
		const lanes part = lanes_clamp(z[i], least, most);
		z[i] = (z[i] - part) + factor * part;
	}
	return (struct flow_price){price.forward * shrink, price.backward * shrink};
}

/* w - u of one edge goes to its ends. */
static inline void scatter(const lanes *z, lanes *u, lanes *v, uint32_t vectors, struct flow_price price)
{
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	for (uint32_t i = 0; i < vectors; i++) {
		const lanes part = lanes_clamp(z[i], least, most), difference = (z[i] - part) - part;
		u[i] += difference;
		v[i] -= difference;
	}
}

static inline void advance_edge(struct flow *flow, uint32_t e, float shrink)
{
	const size_t vectors = flow->stride / LANES;
	const lanes *const potential = (const lanes *)flow->potential;
	lanes *const z = (lanes *)flow->z + e * vectors;
	relax(z, potential + flow->ends[2 * e] * vectors, potential + flow->ends[2 * e + 1] * vectors,
	      (uint32_t)vectors, flow->inverse[e], flow->price[e]);
	const struct flow_price price = project(z, (uint32_t)vectors, flow->price[e]);
	flow->price[e] = shrink < 1 ? settle(z, (uint32_t)vectors, price, shrink) : price;
}

/* For the vectors first…end-1 of the edge's row. */
static inline void scatter_edge(struct flow *flow, uint32_t e, uint32_t first, uint32_t end)
{
	const size_t vectors = flow->stride / LANES;
	lanes *const next = (lanes *)flow->next + first;
	scatter((const lanes *)flow->z + e * vectors + first, next + flow->ends[2 * e] * vectors,
		next + flow->ends[2 * e + 1] * vectors, end - first, flow->price[e]);
}

/* One thread goes over the edges once, while a row is in its cache. Several first share the edges, then the columns, in
 * which the sums of one vertex must stay in the order of its edges. */
struct sweep {
	struct flow *flow;
	float shrink;
};

static void advance_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	const struct sweep *sweep = context;
	(void)thread;
	for (uint32_t e = first; e < end; e++)
		advance_edge(sweep->flow, e, sweep->shrink);
}

static void scatter_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct flow *const flow = ((const struct sweep *)context)->flow;
	const size_t columns = (size_t)(end - first) * LANES_BLOCK;
	const uint32_t vectors = LANES_BLOCK / LANES;
	(void)thread;
	for (uint32_t v = 0; v < flow->vertex_count; v++)
		memset(flow->next + (size_t)v * flow->stride + (size_t)first * LANES_BLOCK, 0,
		       columns * sizeof *flow->next);
	for (uint32_t e = 0; e < flow->edge_count; e++)
		scatter_edge(flow, e, first * vectors, end * vectors);
}

void flow_sweep(struct flow *flow, float shrink, unsigned threads)
{
	const uint32_t blocks = flow->stride / LANES_BLOCK;
	struct sweep sweep = {flow, shrink};
	assert(flow->stride % LANES_BLOCK == 0);
	if (threads > 1) {
		parallel_for(threads, flow->edge_count, flow->edge_count / (4 * threads) + 1, advance_part, &sweep);
		parallel_for(threads, blocks, (blocks + threads - 1) / threads, scatter_part, &sweep);
		return;
	}
	memset(flow->next, 0, (size_t)flow->vertex_count * flow->stride * sizeof *flow->next);
	for (uint32_t e = 0; e < flow->edge_count; e++) {
		advance_edge(flow, e, shrink);
		scatter_edge(flow, e, 0, flow->stride / LANES);
	}
}

void flow_restore(struct flow *flow)
{
	struct sweep sweep = {flow, 1};
	scatter_part(&sweep, 0, 0, flow->stride / LANES_BLOCK);
}
