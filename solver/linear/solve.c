/* Purpose: a solve's steps, by the kernels of the machine. */
#include "solver/linear/kernels.h"

#include <assert.h>
#include <string.h>

void ldl_forward(const struct ldl *ldl, float *x, uint32_t stride, uint32_t part)
{
	const struct ldl_part *const it = &ldl->part[part];
	assert(part < ldl->part_count && stride % LANES_BLOCK == 0);
	ldl_kernels_of(ldl->isa)->forward(ldl, x, 0, stride, it->panel, it->panel_end);
}

/* The right-hand sides of a chunk: what the parts have for a row is added in the order of the parts. */
static void gather(const struct ldl *ldl, const float *x, uint32_t stride, float *to, uint32_t width)
{
	const struct ldl_part *const top = &ldl->part[ldl->part_count];
	for (uint32_t p = top->first; p < top->end; p++)
		memcpy(to + (size_t)(p - top->first) * width, x + (size_t)p * stride, width * sizeof *to);
	for (const struct ldl_part *part = ldl->part; part < top; part++)
		for (uint32_t p = part->end; p < part->copies_end; p++) {
			float *const sum = to + (size_t)(ldl->original[p] - top->first) * width;
			const float *const from = x + (size_t)p * stride;
			for (uint32_t i = 0; i < width; i++)
				sum[i] += from[i];
		}
}

static uint32_t chunk_width(const struct ldl_top *top, uint32_t stride, uint32_t chunk)
{
	const uint32_t left = stride - chunk * top->width;
	return left < top->width ? left : top->width;
}

void ldl_solve_top(const struct ldl *ldl, const float *x, const struct ldl_top *top, uint32_t stride, uint32_t chunk)
{
	const struct ldl_part *const it = &ldl->part[ldl->part_count];
	const struct ldl_kernels *const kernels = ldl_kernels_of(ldl->isa);
	const uint32_t first = chunk * top->width, width = chunk_width(top, stride, chunk);
	float *const own = top->value + (size_t)(it->end - it->first) * first;
	assert(first < stride && stride % LANES_BLOCK == 0 && top->width % LANES_BLOCK == 0);
	gather(ldl, x + first, stride, own, width);
	kernels->forward(ldl, own, it->first, width, it->panel, it->panel_end);
	kernels->backward(ldl, own, it->first, width, it->panel, it->panel_end);
}

/* The top's solution goes to a row of x. */
static void fetch_row(const struct ldl *ldl, float *x, const struct ldl_top *top, uint32_t stride, uint32_t place)
{
	const struct ldl_part *const it = &ldl->part[ldl->part_count];
	const size_t rows = it->end - it->first, row = ldl->original[place] - it->first;
	float *const to = x + (size_t)place * stride;
	for (uint32_t first = 0, chunk = 0; first < stride; first += top->width, chunk++) {
		const uint32_t width = chunk_width(top, stride, chunk);
		memcpy(to + first, top->value + rows * first + row * width, width * sizeof *x);
	}
}

void ldl_backward(const struct ldl *ldl, float *x, const struct ldl_top *top, uint32_t stride, uint32_t part)
{
	const struct ldl_part *const it = &ldl->part[part];
	const bool is_top = part == ldl->part_count;
	assert(part <= ldl->part_count && stride % LANES_BLOCK == 0);
	for (uint32_t p = is_top ? it->first : it->end; p < it->copies_end; p++)
		fetch_row(ldl, x, top, stride, p);
	if (!is_top)
		ldl_kernels_of(ldl->isa)->backward(ldl, x, 0, stride, it->panel, it->panel_end);
}

void ldl_solve(const struct ldl *ldl, float *x, const struct ldl_top *top, uint32_t stride)
{
	for (uint32_t part = 0; part < ldl->part_count; part++)
		ldl_forward(ldl, x, stride, part);
	for (uint32_t chunk = 0; chunk * top->width < stride; chunk++)
		ldl_solve_top(ldl, x, top, stride, chunk);
	for (uint32_t part = 0; part <= ldl->part_count; part++)
		ldl_backward(ldl, x, top, stride, part);
}
