/* The kernels, for the instruction set that the including file is compiled for. LDL_KERNELS is the table's name.
 *
 * Whole panels at a time: a row of the right-hand sides is loaded once for all columns of a panel, and a panel, some
 * kilobytes, stays in the first cache for all blocks of columns. */
#include "solver/linear/kernels.h"

#include <string.h>

#if LANES_NATIVE == 16
#define LANES lanes16
#define STEP(name) name##_16
#include "solver/linear/panel_steps.h"
#endif
#if LANES_NATIVE >= 8
#define LANES lanes8
#define STEP(name) name##_8
#include "solver/linear/panel_steps.h"
#else
#define LANES lanes4
#define STEP(name) name##_4
#include "solver/linear/panel_steps.h"
#endif

/* How many columns a call takes of those that are left: as many as the registers hold for four rows of them. */
#if LANES_NATIVE == 16
#define FOR_COLUMNS(step)                                                                                              \
	do {                                                                                                           \
		if (stride - i >= 48)                                                                                  \
			step##_16(ldl, at, x + i, base, stride, 3), i += 48;                                           \
		else if (stride - i >= 32)                                                                             \
			step##_16(ldl, at, x + i, base, stride, 2), i += 32;                                           \
		else if (stride - i >= 16)                                                                             \
			step##_16(ldl, at, x + i, base, stride, 1), i += 16;                                           \
		else                                                                                                   \
			step##_8(ldl, at, x + i, base, stride, 1), i += 8;                                             \
	} while (i < stride)
#elif LANES_NATIVE == 8
#define FOR_COLUMNS(step)                                                                                              \
	do {                                                                                                           \
		if (stride - i >= 16)                                                                                  \
			step##_8(ldl, at, x + i, base, stride, 2), i += 16;                                            \
		else                                                                                                   \
			step##_8(ldl, at, x + i, base, stride, 1), i += 8;                                             \
	} while (i < stride)
#else
#define FOR_COLUMNS(step)                                                                                              \
	do {                                                                                                           \
		step##_4(ldl, at, x + i, base, stride, 2), i += 8;                                                     \
	} while (i < stride)
#endif

static void forward(const struct ldl *ldl, float *x, uint32_t base, uint32_t stride, uint32_t panel, uint32_t panel_end)
{
	for (uint32_t p = panel; p < panel_end; p++) {
		const struct ldl_panel *const at = &ldl->panel[p];
		uint32_t i = 0;
		FOR_COLUMNS(forward_any);
	}
}

enum { AHEAD = 3 };

/* Brings a panel's own rows and its values into the cache, some panels before they are wanted: machines foresee only
 * what ascends. 12 per cent fewer ms an iteration with 80 terminals, 9 at 94,000 vertices; forward it gained nothing.
 */
static inline void foresee(const struct ldl *ldl, const struct ldl_panel *panel, const float *x, uint32_t base,
			   uint32_t stride)
{
	const float *const own = x + (size_t)(panel->first - base) * stride;
	const float *const value = ldl->value + panel->value;
	for (uint32_t at = 0; at < panel->width * stride; at += 16)
		__builtin_prefetch(own + at, 1);
	for (uint32_t at = 0; at < (panel->row_count + panel->width) * panel->width; at += 16)
		__builtin_prefetch(value + at, 0);
}

static void backward(const struct ldl *ldl, float *x, uint32_t base, uint32_t stride, uint32_t panel,
		     uint32_t panel_end)
{
	for (uint32_t p = panel_end; p-- > panel;) {
		const struct ldl_panel *const at = &ldl->panel[p];
		uint32_t i = 0;
		if (p - panel >= AHEAD)
			foresee(ldl, at - AHEAD, x, base, stride);
		FOR_COLUMNS(backward_any);
	}
}

#if LANES_NATIVE >= 8
typedef double sums __attribute__((vector_size(32), aligned(8), may_alias));
#else
typedef double sums __attribute__((vector_size(16), aligned(8), may_alias));
#endif
enum { SUMS = LDL_PANEL_WIDTH * sizeof(double) / sizeof(sums) };

static inline __attribute__((always_inline)) void subtract_rows(double *sum, const uint32_t *at, const uint32_t *row,
								uint32_t count, const float *l, const uint32_t width,
								const double *share)
{
	sums f[LDL_PANEL_WIDTH][SUMS];
	for (uint32_t c = 0; c < width; c++)
		memcpy(f[c], share + c * LDL_PANEL_WIDTH, sizeof f[c]);
	for (uint32_t r = 0; r < count; r++, l += width) {
		sums *const to = (sums *)(sum + (size_t)at[row[r]] * LDL_PANEL_WIDTH);
		for (uint32_t i = 0; i < SUMS; i++) {
			sums s = to[i];
			for (uint32_t c = 0; c < width; c++)
				s -= f[c][i] * (double)l[c];
			to[i] = s;
		}
	}
}

static void subtract(double *sum, const uint32_t *at, const uint32_t *row, uint32_t count, const float *l,
		     uint32_t width, const double *share)
{
	if (width == 4)
		subtract_rows(sum, at, row, count, l, 4, share);
	else if (width == 3)
		subtract_rows(sum, at, row, count, l, 3, share);
	else if (width == 2)
		subtract_rows(sum, at, row, count, l, 2, share);
	else
		subtract_rows(sum, at, row, count, l, 1, share);
}

const struct ldl_kernels LDL_KERNELS = {forward, backward, subtract};
