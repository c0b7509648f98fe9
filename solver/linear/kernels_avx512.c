#ifdef __x86_64__
#define LDL_KERNELS ldl_kernels_avx512
#include "solver/linear/kernels_lanes.h"
#else
typedef int nothing_here;
#endif
