/* Purpose: a solve's steps, by the kernels of the machine. */
#include "solver/linear/kernels.h"

#include <assert.h>
#include <string.h>

void ldl_forward(const struct ldl *ldl, float *x, uint32_t stride, uint32_t part)
{
	const struct ldl_part *const it = &ldl->part[part];
	assert(part < ldl->part_count && stride % LANES_BLOCK == 0);
	ldl_kernels_of(ldl->isa)->forward(ldl, x, stride, 0, stride, it->panel, it->panel_end);
}

void ldl_backward(const struct ldl *ldl, float *x, uint32_t stride, uint32_t part)
{
	const struct ldl_part *const it = &ldl->part[part];
	assert(part < ldl->part_count && stride % LANES_BLOCK == 0);
	ldl_kernels_of(ldl->isa)->backward(ldl, x, stride, 0, stride, it->panel, it->panel_end);
}

/* What the parts have for the top is added in the order of the parts. */
static void gather_copies(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end)
{
	for (uint32_t part = 0; part < ldl->part_count; part++)
		for (uint32_t p = ldl->part[part].end; p < ldl->part[part].copies_end; p++) {
			float *const to = x + (size_t)ldl->original[p] * stride;
			const float *const from = x + (size_t)p * stride;
			for (uint32_t i = first; i < end; i++)
				to[i] += from[i];
		}
}

static void hand_out_copies(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end)
{
	for (uint32_t part = 0; part < ldl->part_count; part++)
		for (uint32_t p = ldl->part[part].end; p < ldl->part[part].copies_end; p++)
			memcpy(x + (size_t)p * stride + first, x + (size_t)ldl->original[p] * stride + first,
			       (end - first) * sizeof *x);
}

void ldl_solve_top(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end)
{
	const struct ldl_part *const top = &ldl->part[ldl->part_count];
	const struct ldl_kernels *const kernels = ldl_kernels_of(ldl->isa);
	assert(first % LANES_BLOCK == 0 && end % LANES_BLOCK == 0 && first < end && end <= stride);
	gather_copies(ldl, x, stride, first, end);
	kernels->forward(ldl, x, stride, first, end, top->panel, top->panel_end);
	kernels->backward(ldl, x, stride, first, end, top->panel, top->panel_end);
	hand_out_copies(ldl, x, stride, first, end);
}

void ldl_solve(const struct ldl *ldl, float *x, uint32_t stride)
{
	for (uint32_t part = 0; part < ldl->part_count; part++)
		ldl_forward(ldl, x, stride, part);
	ldl_solve_top(ldl, x, stride, 0, stride);
	for (uint32_t part = 0; part < ldl->part_count; part++)
		ldl_backward(ldl, x, stride, part);
}
