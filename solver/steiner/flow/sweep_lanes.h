/* Over-relaxation, projection, and the next right-hand side, in one pass over edges, for the instruction set that the
 * including file is compiled for. SWEEP_KERNELS is the table's name.
 *
 * With d = (p(u) - p(v)) / c for all commodities of an edge: z <- alpha d + (1 - alpha) w + u, where w and u are those
 * of the old z; then w = proj_K(z). The positive and the negative parts are projected apart: where they sum to more
 * than 1, each gives up the same mu, but none more than it has. mu is the root of a convex piecewise linear function,
 * found by Newton's method from the last value (each step: the sum of those above mu, less 1, over their number); it
 * comes from below after the first step, so that stopping early leaves a little more than 1, which flow_split cuts off.
 *
 * A sum over commodities has 8 sums of every eighth, in order, which are then added as ((0 + 4) + (2 + 6)) + ((1 + 5) +
 * (3 + 7)), whatever the width of the vectors. */
#include "solver/steiner/flow/sweep.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

/* Edges that are looked at together, since Newton steps wait for their sums, and branches for whether there are prices.
 * Measured with 4 to 32: 15 per cent fewer ms than one by one in the first iterations, as many in late ones. */
enum { BATCH = 8 };

#define INLINE static inline __attribute__((always_inline))

/* 1.8 is ADMM's usual over-relaxation. Two Newton steps a sweep: one leaves mu behind when many commodities meet, a
 * third changes nothing after the first iterations. */
static const float relaxation = 1.8f;

/* Vectors, PER_BLOCK of them to a block. a > b ? a : b in each lane, and a < b ? a : b; and a sum and a number (less
 * than 0) of those above or below. */
#if LANES_NATIVE >= 8
typedef lanes8 lanes;
typedef mask8 lanes_mask;
enum { PER_BLOCK = 1 };

INLINE lanes lanes_max(lanes a, lanes b)
{
	return (lanes)_mm256_max_ps((__m256)a, (__m256)b);
}

INLINE lanes lanes_min(lanes a, lanes b)
{
	return (lanes)_mm256_min_ps((__m256)a, (__m256)b);
}

INLINE lanes4 fold(const lanes *sum)
{
	return __builtin_shufflevector(*sum, *sum, 0, 1, 2, 3) + __builtin_shufflevector(*sum, *sum, 4, 5, 6, 7);
}

INLINE lanes4 fold_numbers(const lanes_mask *number)
{
	return __builtin_convertvector(__builtin_shufflevector(*number, *number, 0, 1, 2, 3) +
					       __builtin_shufflevector(*number, *number, 4, 5, 6, 7),
				       lanes4);
}
#else
typedef lanes4 lanes;
typedef mask4 lanes_mask;
enum { PER_BLOCK = 2 };

INLINE lanes lanes_max(lanes a, lanes b)
{
#ifdef __x86_64__
	return (lanes)_mm_max_ps((__m128)a, (__m128)b);
#else
	const lanes_mask mask = a > b;
	return (lanes)((mask & (lanes_mask)a) | (~mask & (lanes_mask)b));
#endif
}

INLINE lanes lanes_min(lanes a, lanes b)
{
#ifdef __x86_64__
	return (lanes)_mm_min_ps((__m128)a, (__m128)b);
#else
	const lanes_mask mask = a < b;
	return (lanes)((mask & (lanes_mask)a) | (~mask & (lanes_mask)b));
#endif
}

INLINE lanes4 fold(const lanes *sum)
{
	return sum[0] + sum[1];
}

INLINE lanes4 fold_numbers(const lanes_mask *number)
{
	return __builtin_convertvector(number[0] + number[1], lanes4);
}
#endif

INLINE lanes lanes_of(float x)
{
	return (lanes){0} + x;
}

/* What is above the forward price, and below the backward one. */
struct beyond {
	lanes above[PER_BLOCK], below[PER_BLOCK];
	lanes_mask above_number[PER_BLOCK], below_number[PER_BLOCK]; /* negated */
};

INLINE void count_beyond(struct beyond *beyond, unsigned i, lanes z, lanes most, lanes least)
{
#if LANES_NATIVE == 16
	const __mmask8 above = _mm256_cmp_ps_mask((__m256)z, (__m256)most, _CMP_GT_OQ);
	const __mmask8 below = _mm256_cmp_ps_mask((__m256)z, (__m256)least, _CMP_LT_OQ);
	const __m256i one = _mm256_set1_epi32(1);
	beyond->above[i] =
		(lanes)_mm256_mask_add_ps((__m256)beyond->above[i], above, (__m256)beyond->above[i], (__m256)z);
	beyond->below[i] =
		(lanes)_mm256_mask_sub_ps((__m256)beyond->below[i], below, (__m256)beyond->below[i], (__m256)z);
	beyond->above_number[i] = (lanes_mask)_mm256_mask_sub_epi32((__m256i)beyond->above_number[i], above,
								    (__m256i)beyond->above_number[i], one);
	beyond->below_number[i] = (lanes_mask)_mm256_mask_sub_epi32((__m256i)beyond->below_number[i], below,
								    (__m256i)beyond->below_number[i], one);
#else
	const lanes_mask above = z > most, below = z < least;
	beyond->above[i] += (lanes)(above & (lanes_mask)z);
	beyond->below[i] -= (lanes)(below & (lanes_mask)z);
	beyond->above_number[i] += above;
	beyond->below_number[i] += below;
#endif
}

/* Of each direction the sum, and less the number. */
INLINE lanes4 sum_up(const struct beyond *beyond)
{
	const lanes4 above = fold(beyond->above), below = fold(beyond->below);
	const lanes4 above_number = fold_numbers(beyond->above_number),
		     below_number = fold_numbers(beyond->below_number);
	const lanes4 sums =
		__builtin_shufflevector(above, below, 0, 4, 1, 5) + __builtin_shufflevector(above, below, 2, 6, 3, 7);
	const lanes4 numbers = __builtin_shufflevector(above_number, below_number, 0, 4, 1, 5) +
			       __builtin_shufflevector(above_number, below_number, 2, 6, 3, 7);
	return __builtin_shufflevector(sums, numbers, 0, 1, 4, 5) + __builtin_shufflevector(sums, numbers, 2, 3, 6, 7);
}

/* Both prices at once. */
INLINE struct flow_price newton(lanes4 sums)
{
	const lanes4 excess = sums - 1, number = -__builtin_shufflevector(sums, sums, 2, 3, 2, 3);
	const lanes4 price = (lanes4)((mask4)(excess / number) & (excess > 0));
	return (struct flow_price){price[0], price[1]};
}

INLINE lanes4 sum_beyond(const lanes *z, unsigned blocks, struct flow_price price)
{
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	struct beyond beyond = {0};
	for (unsigned b = 0; b < blocks; b++)
		for (unsigned i = 0; i < PER_BLOCK; i++, z++)
			count_beyond(&beyond, i, *z, most, least);
	return sum_up(&beyond);
}

/* New z of an edge that had prices, and what is beyond these. */
INLINE lanes4 relax(lanes *z, const lanes *u, const lanes *v, unsigned blocks, float inverse, struct flow_price price)
{
	const lanes scale = lanes_of(relaxation * inverse), keep = lanes_of(1 - relaxation),
		    less = lanes_of(relaxation);
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	struct beyond beyond = {0};
	for (unsigned b = 0, at = 0; b < blocks; b++)
		for (unsigned i = 0; i < PER_BLOCK; i++, at++) {
			const lanes part = lanes_min(most, lanes_max(least, z[at]));
			/* (1 - alpha) (z - part) + part */
			z[at] = scale * (u[at] - v[at]) + keep * z[at] + less * part;
			count_beyond(&beyond, i, z[at], most, least);
		}
	return sum_up(&beyond);
}

/* New z of an edge without prices, as most are. Whether it needs any. */
INLINE bool relax_free(lanes *z, const lanes *u, const lanes *v, unsigned blocks, float inverse)
{
	const lanes scale = lanes_of(relaxation * inverse), keep = lanes_of(1 - relaxation), zero = {0};
	lanes above[PER_BLOCK] = {0}, below[PER_BLOCK] = {0};
	for (unsigned b = 0, at = 0; b < blocks; b++)
		for (unsigned i = 0; i < PER_BLOCK; i++, at++) {
			z[at] = scale * (u[at] - v[at]) + keep * z[at];
			above[i] += lanes_max(z[at], zero);
			below[i] += lanes_min(z[at], zero);
		}
	const lanes4 a = fold(above), b = -fold(below);
	const lanes4 half = __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7);
	return (half[0] + half[2] > 1) | (half[1] + half[3] > 1);
}

/* u becomes shrink * u, and with it z = w + u. */
INLINE struct flow_price settle(lanes *z, unsigned vectors, struct flow_price price, float shrink)
{
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	for (unsigned i = 0; i < vectors; i++) {
		const lanes part = lanes_min(most, lanes_max(least, z[i]));
		z[i] = (z[i] - part) + part * shrink;
	}
	return (struct flow_price){price.forward * shrink, price.backward * shrink};
}

/* w - u of one edge goes to its ends. */
INLINE void hand_out(const lanes *z, lanes *u, lanes *v, unsigned vectors, struct flow_price price)
{
	const lanes most = lanes_of(price.forward), least = lanes_of(-price.backward);
	for (unsigned i = 0; i < vectors; i++) {
		const lanes part = lanes_min(most, lanes_max(least, z[i])), difference = (z[i] - part) - part;
		u[i] += difference;
		v[i] -= difference;
	}
}

/* Of a batch's edges those that have prices, with what is beyond these, and those that have come to need some. */
struct priced {
	uint32_t had[BATCH], wants[BATCH];
	lanes4 sums[BATCH];
	uint32_t had_count, wants_count;
};

/* Brings an edge's z into the cache: 3 to 10 per cent fewer ms, since the machine's own foresight ends with a page. */
INLINE void foresee(const struct flow *flow, uint32_t e)
{
	const float *const z = flow->z + (size_t)e * flow->stride;
	for (uint32_t at = 0; at < flow->stride; at += 16)
		__builtin_prefetch(z + at, 1);
}

INLINE void relax_edge(struct flow *flow, uint32_t e, unsigned blocks, struct priced *priced)
{
	const size_t row = (size_t)blocks * PER_BLOCK;
	const lanes *const u = (const lanes *)flow->potential + flow->ends[2 * e] * row;
	const lanes *const v = (const lanes *)flow->potential + flow->ends[2 * e + 1] * row;
	lanes *const z = (lanes *)flow->z + e * row;
	const struct flow_price price = flow->price[e];
	if (price.forward != 0 || price.backward != 0) {
		priced->had[priced->had_count] = e;
		priced->sums[priced->had_count++] = relax(z, u, v, blocks, flow->inverse[e], price);
	} else {
		/* No branch: nobody could foresee it. */
		priced->wants[priced->wants_count] = e;
		priced->wants_count += relax_free(z, u, v, blocks, flow->inverse[e]);
	}
}

INLINE void price_edge(struct flow *flow, uint32_t e, unsigned blocks, lanes4 sums, float shrink)
{
	const size_t row = (size_t)blocks * PER_BLOCK;
	lanes *const z = (lanes *)flow->z + e * row;
	const struct flow_price price = newton(sum_beyond(z, blocks, newton(sums)));
	flow->price[e] = shrink < 1 ? settle(z, (unsigned)row, price, shrink) : price;
}

INLINE void sweep_blocks(struct flow *flow, uint32_t first, uint32_t end, float shrink, const unsigned blocks)
{
	const size_t row = (size_t)blocks * PER_BLOCK;
	for (uint32_t next; first < end; first = next) {
		struct priced priced;
		priced.had_count = priced.wants_count = 0;
		next = end - first < BATCH ? end : first + BATCH;
		for (uint32_t e = first; e < next; e++) {
			if (e + BATCH < flow->edge_count)
				foresee(flow, e + BATCH);
			relax_edge(flow, e, blocks, &priced);
		}
		for (uint32_t i = 0; i < priced.had_count; i++)
			price_edge(flow, priced.had[i], blocks, priced.sums[i], shrink);
		for (uint32_t i = 0; i < priced.wants_count; i++) {
			const lanes *const z = (const lanes *)flow->z + priced.wants[i] * row;
			const lanes4 sums = sum_beyond(z, blocks, (struct flow_price){0, 0});
			price_edge(flow, priced.wants[i], blocks, sums, shrink);
		}
		for (uint32_t e = first; e < next; e++)
			hand_out((lanes *)flow->z + e * row, (lanes *)flow->next + flow->ends[2 * e] * row,
				 (lanes *)flow->next + flow->ends[2 * e + 1] * row, (unsigned)row, flow->price[e]);
	}
}

static void sweep(struct flow *flow, uint32_t first, uint32_t end, float shrink)
{
	const unsigned blocks = flow->stride / LANES_BLOCK;
	switch (blocks) {
	case 1:
		sweep_blocks(flow, first, end, shrink, 1);
		break;
	case 2:
		sweep_blocks(flow, first, end, shrink, 2);
		break;
	case 3:
		sweep_blocks(flow, first, end, shrink, 3);
		break;
	case 4:
		sweep_blocks(flow, first, end, shrink, 4);
		break;
	case 5:
		sweep_blocks(flow, first, end, shrink, 5);
		break;
	case 6:
		sweep_blocks(flow, first, end, shrink, 6);
		break;
	default:
		sweep_blocks(flow, first, end, shrink, blocks);
	}
}

static void scatter(struct flow *flow, uint32_t first, uint32_t end)
{
	const size_t row = (size_t)flow->stride / LANES_BLOCK * PER_BLOCK;
	for (uint32_t e = first; e < end; e++)
		hand_out((const lanes *)flow->z + e * row, (lanes *)flow->next + flow->ends[2 * e] * row,
			 (lanes *)flow->next + flow->ends[2 * e + 1] * row, (unsigned)row, flow->price[e]);
}

const struct sweep_kernels SWEEP_KERNELS = {sweep, scatter};
