/* Which of its kernels' variants a machine can run. Variants differ in the width of their vectors and give the same
 * bits (lanes.h), so that the choice is one of speed alone. */
#ifndef SOLVER_LINEAR_ISA_H
#define SOLVER_LINEAR_ISA_H

#include <stdbool.h>

/* ISA_BASE is what every machine of its architecture has: SSE2, NEON. */
enum isa { ISA_BASE, ISA_AVX2, ISA_AVX512, ISA_COUNT };

/* Whether this machine can run a variant, and which is its fastest. */
bool isa_is_there(enum isa isa);
enum isa isa_best(void);

#endif
