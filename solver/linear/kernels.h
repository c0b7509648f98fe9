/* The loops in which the time goes, a variant for each instruction set (isa.h): the same source, solve_lanes.h and
 * factor_lanes.h, compiled with other flags. For this folder's own files. */
#ifndef SOLVER_LINEAR_KERNELS_H
#define SOLVER_LINEAR_KERNELS_H

#include "solver/linear/ldl.h"

struct ldl_kernels {
	/* The panels panel…panel_end - 1, for all columns of x, whole blocks; x begins with the row of place `base`.
	 * Forward in their order, backward in the other. */
	void (*forward)(const struct ldl *ldl, float *x, uint32_t base, uint32_t stride, uint32_t panel,
			uint32_t panel_end);
	void (*backward)(const struct ldl *ldl, float *x, uint32_t base, uint32_t stride, uint32_t panel,
			 uint32_t panel_end);
	/* For `count` rows of `width` values l: the row at[row[i]] of `sum`, LDL_PANEL_WIDTH numbers, loses the row's
	 * values times the rows of `share`, which are as long. */
	void (*subtract)(double *sum, const uint32_t *at, const uint32_t *row, uint32_t count, const float *l,
			 uint32_t width, const double *share);
};

extern const struct ldl_kernels ldl_kernels_base, ldl_kernels_avx2, ldl_kernels_avx512;

static inline const struct ldl_kernels *ldl_kernels_of(enum isa isa)
{
#ifdef __x86_64__
	if (isa == ISA_AVX512)
		return &ldl_kernels_avx512;
	if (isa == ISA_AVX2)
		return &ldl_kernels_avx2;
#endif
	(void)isa;
	return &ldl_kernels_base;
}

#endif
