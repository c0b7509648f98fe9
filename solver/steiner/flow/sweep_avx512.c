#ifdef __x86_64__
#define SWEEP_KERNELS sweep_kernels_avx512
#include "solver/steiner/flow/sweep_lanes.h"
#else
typedef int nothing_here;
#endif
