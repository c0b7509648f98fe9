/* The kernels of the flow dual, as compiled for several instruction sets. */
#ifndef TESTS_ISA_KERNELS_H
#define TESTS_ISA_KERNELS_H

#include "solver/steiner/flow/state.h"

#define ISA_KERNELS(isa)                                                                                               \
	enum tw_status ldl_factorise_##isa(struct ldl *ldl, struct arena *scratch, const struct ldl_graph *graph,      \
					   const double *weight, uint32_t ground, ldl_goes_on *goes_on,                \
					   void *context);                                                             \
	void ldl_solve_##isa(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end);          \
	void flow_sweep_##isa(struct flow *flow, float shrink, unsigned threads);

ISA_KERNELS(base)
#ifdef __x86_64__
ISA_KERNELS(avx2)
ISA_KERNELS(avx512)
#endif

#endif
