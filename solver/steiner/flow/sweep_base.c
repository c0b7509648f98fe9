#define SWEEP_KERNELS sweep_kernels_base
#include "solver/steiner/flow/sweep_lanes.h"
