#include "solver/linear/isa.h"

bool isa_is_there(enum isa isa)
{
#ifdef __x86_64__
	if (isa == ISA_AVX2)
		return __builtin_cpu_supports("avx2");
	if (isa == ISA_AVX512)
		return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
		       __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
#endif
	return isa == ISA_BASE;
}

enum isa isa_best(void)
{
	return isa_is_there(ISA_AVX512) ? ISA_AVX512 : isa_is_there(ISA_AVX2) ? ISA_AVX2 : ISA_BASE;
}
