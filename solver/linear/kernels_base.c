#define LDL_KERNELS ldl_kernels_base
#include "solver/linear/kernels_lanes.h"
