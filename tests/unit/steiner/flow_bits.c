/* The flow dual's floats are the same bits on every machine: its kernels, compiled for SSE2, for AVX2 with fused
 * multiplications at hand, and for AVX-512, are run side by side. */
#include "setting.h"
#include "tests/isa/kernels.h"

enum { MESHES = 6, ITERATIONS = 45, PERIOD = 10 };

struct kernels {
	const char *name;
	bool (*is_there)(void);
	enum tw_status (*factorise)(struct ldl *, struct arena *, const struct ldl_graph *, const double *, uint32_t,
				    ldl_goes_on *, void *);
	void (*solve)(const struct ldl *, float *, uint32_t, uint32_t, uint32_t);
	void (*sweep)(struct flow *, float, unsigned);
};

static bool always(void)
{
	return true;
}

#ifdef __x86_64__
static bool has_avx2(void)
{
	return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}

static bool has_avx512(void)
{
	return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
	       __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
}
#endif

static const struct kernels kernels[] = {
	{"base", always, ldl_factorise_base, ldl_solve_base, flow_sweep_base},
#ifdef __x86_64__
	{"avx2", has_avx2, ldl_factorise_avx2, ldl_solve_avx2, flow_sweep_avx2},
	{"avx512", has_avx512, ldl_factorise_avx512, ldl_solve_avx512, flow_sweep_avx512},
#endif
};
enum { KERNELS = sizeof kernels / sizeof *kernels };

/* What an iteration leaves. */
struct bits {
	uint64_t z, price, potential, value;
};

static uint64_t hash(const void *data, size_t size)
{
	const unsigned char *bytes = data;
	uint64_t h = 0xcbf29ce484222325u;
	for (size_t i = 0; i < size; i++)
		h = (h ^ bytes[i]) * 0x100000001b3u;
	return h;
}

/* The whole of a flow's life with one set of kernels: factor, then iterations as iterate.c does them. */
static struct bits run(const struct kernels *k, uint64_t seed, unsigned threads)
{
	struct setting s;
	struct dual dual;
	struct flow *flow;
	setting_mesh(&s, seed);
	setting_open(&s, 0);
	assert_int_equal(dual_ascend_best(&dual, &s.search, 1000), TW_OK);
	assert_int_equal(flow_new(&flow, &s.search, &dual), TW_OK);
	const struct instance *instance = &s.search.instance;
	const struct ldl_graph graph = {instance->vertex_count, instance->edge_count, instance->ends};
	double weight[CASE_EDGES];
	for (uint32_t e = 0; e < instance->edge_count; e++)
		weight[e] = flow->inverse[flow->slot[e]];
	assert_int_equal(k->factorise(&flow->ldl, s.arena, &graph, weight, instance->terminal[dual.root], NULL, NULL),
			 TW_OK);
	for (uint32_t i = 1; i <= ITERATIONS; i++) {
		for (uint32_t c = 0; c < flow->commodity_count; c++)
			flow->next[(size_t)flow->sink[c] * flow->stride + c] -= 1 / flow->omega;
		memset(flow->next + (size_t)flow->ground * flow->stride, 0, flow->stride * sizeof(float));
		float *x = flow->next;
		flow->next = flow->potential;
		flow->potential = x;
		k->solve(&flow->ldl, x, flow->stride, 0, flow->stride);
		k->sweep(flow, i % PERIOD ? 1 : 1 / 1.2f, threads);
		flow->omega *= i % PERIOD ? 1 : 1.2f;
	}
	const size_t row = flow->stride * sizeof(float);
	const struct bits bits = {
		.z = hash(flow->z, flow->edge_count * row),
		.price = hash(flow->price, flow->edge_count * sizeof *flow->price),
		.potential = hash(flow->potential, flow->vertex_count * row),
		.value = hash(flow->ldl.value, ldl_entries(&flow->ldl) * sizeof(float)),
	};
	arena_free(s.arena);
	return bits;
}

static void every_instruction_set_gives_the_same_bits(void **state)
{
	(void)state;
	uint32_t compared = 0;
	for (uint64_t seed = 0; seed < MESHES; seed++) {
		const struct bits base = run(&kernels[0], seed, 1);
		for (uint32_t k = 0; k < KERNELS; k++) {
			if (!kernels[k].is_there())
				continue;
			for (unsigned threads = 1; threads <= 3; threads++) {
				const struct bits other = run(&kernels[k], seed, threads);
				if (memcmp(&base, &other, sizeof base) != 0)
					fail_msg("%s, %u threads, mesh %u: other bits", kernels[k].name, threads,
						 (unsigned)seed);
				compared++;
			}
		}
	}
	assert_true(compared >= 3 * MESHES);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_instruction_set_gives_the_same_bits),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
