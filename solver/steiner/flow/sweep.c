/* Purpose: the sweep over a part's edges, by the kernels of the machine. */
#include "solver/steiner/flow/sweep.h"

#include <assert.h>
#include <string.h>

static const struct sweep_kernels *kernels_of(enum isa isa)
{
#ifdef __x86_64__
	if (isa == ISA_AVX512)
		return &sweep_kernels_avx512;
	if (isa == ISA_AVX2)
		return &sweep_kernels_avx2;
#endif
	(void)isa;
	return &sweep_kernels_base;
}

static void clear_part(struct flow *flow, uint32_t part)
{
	const struct ldl_part *const it = &flow->ldl.part[part];
	assert(part <= flow->ldl.part_count && flow->stride % LANES_BLOCK == 0);
	memset(flow->next + (size_t)it->first * flow->stride, 0,
	       (size_t)(it->copies_end - it->first) * flow->stride * sizeof *flow->next);
}

void flow_sweep(struct flow *flow, uint32_t part, float shrink)
{
	clear_part(flow, part);
	kernels_of(flow->ldl.isa)->sweep(flow, flow->part_edge[part], flow->part_edge[part + 1], shrink);
}

void flow_restore(struct flow *flow)
{
	for (uint32_t part = 0; part <= flow->ldl.part_count; part++) {
		clear_part(flow, part);
		kernels_of(flow->ldl.isa)->scatter(flow, flow->part_edge[part], flow->part_edge[part + 1]);
	}
}
