/* The float kernels once more, for one instruction set: the Makefile compiles this file for each, with the names that
 * kernels.h gives them. */
#define ISA_JOIN(name, isa) name##_##isa
#define ISA_NAME(name, isa) ISA_JOIN(name, isa)

#define ldl_analyse ISA_NAME(ldl_analyse, ISA)
#define ldl_factorise ISA_NAME(ldl_factorise, ISA)
#define ldl_solve ISA_NAME(ldl_solve, ISA)
#define flow_sweep ISA_NAME(flow_sweep, ISA)
#define flow_restore ISA_NAME(flow_restore, ISA)

#include "solver/linear/ldl.c"
#include "solver/steiner/flow/sweep.c"
