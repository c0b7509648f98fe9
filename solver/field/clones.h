/* One source, compiled for several instruction sets, the best chosen when the program starts. Only for code whose
 * result does not depend on it: elementwise IEEE arithmetic, no contraction. Off where a sanitizer or another compiler
 * does not take part. */
#ifndef SOLVER_FIELD_CLONES_H
#define SOLVER_FIELD_CLONES_H

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define CLONES
#endif

#endif
