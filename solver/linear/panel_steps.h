/* The two steps of a solve in one panel, for `vectors` vectors of the columns; included by solve_lanes.h once for each
 * type of vector, which it names: LANES the type, STEP(name) what the functions are called. `width` and `vectors` are
 * constants where they are called, so that everything but the panel's list of rows stays in registers. */

#define INLINE static inline __attribute__((always_inline))

/* y = L^-1 y in the panel's square; then x -= L y in the rows of its list. */
INLINE void STEP(forward)(const struct ldl *ldl, const struct ldl_panel *panel, float *x, uint32_t base, size_t stride,
			  const unsigned width, const unsigned vectors)
{
	enum { FLOATS = sizeof(LANES) / sizeof(float) };
	const float *l = ldl->value + panel->value;
	const uint32_t *const row = ldl->row + panel->row;
	float *const own = x + (panel->first - base) * stride;
	LANES y[LDL_PANEL_WIDTH][3];
	for (unsigned c = 0; c < width; c++, l += width)
		for (unsigned i = 0; i < vectors; i++) {
			LANES *const at = (LANES *)(own + c * stride + i * FLOATS);
			y[c][i] = *at;
			for (unsigned b = 0; b < c; b++)
				y[c][i] -= y[b][i] * l[b];
			*at = y[c][i];
		}
	for (uint32_t r = 0; r < panel->row_count; r++, l += width) {
		float *const to = x + (row[r] - base) * stride;
		for (unsigned i = 0; i < vectors; i++) {
			LANES *const at = (LANES *)(to + i * FLOATS);
			LANES sum = *at;
			for (unsigned c = 0; c < width; c++)
				sum -= y[c][i] * l[c];
			*at = sum;
		}
	}
}

/* y = D^-1 y - L' x over the rows of the list; then y = L'^-1 y in the square. */
INLINE void STEP(backward)(const struct ldl *ldl, const struct ldl_panel *panel, float *x, uint32_t base, size_t stride,
			   const unsigned width, const unsigned vectors)
{
	enum { FLOATS = sizeof(LANES) / sizeof(float) };
	const float *const square = ldl->value + panel->value, *l = square + width * width;
	const uint32_t *const row = ldl->row + panel->row;
	float *const own = x + (panel->first - base) * stride;
	LANES y[LDL_PANEL_WIDTH][3];
	for (unsigned c = 0; c < width; c++)
		for (unsigned i = 0; i < vectors; i++)
			y[c][i] = *(const LANES *)(own + c * stride + i * FLOATS) * ldl->inverse[panel->first + c];
	for (uint32_t r = 0; r < panel->row_count; r++, l += width) {
		const float *const from = x + (row[r] - base) * stride;
		for (unsigned i = 0; i < vectors; i++) {
			const LANES at = *(const LANES *)(from + i * FLOATS);
			for (unsigned c = 0; c < width; c++)
				y[c][i] -= at * l[c];
		}
	}
	for (unsigned c = width; c-- > 0;)
		for (unsigned i = 0; i < vectors; i++) {
			for (unsigned b = c + 1; b < width; b++)
				y[c][i] -= y[b][i] * square[b * width + c];
			*(LANES *)(own + c * stride + i * FLOATS) = y[c][i];
		}
}

/* The widths in turn. */
INLINE void STEP(forward_any)(const struct ldl *ldl, const struct ldl_panel *panel, float *x, uint32_t base,
			      size_t stride, const unsigned vectors)
{
	if (panel->width == 4)
		STEP(forward)(ldl, panel, x, base, stride, 4, vectors);
	else if (panel->width == 3)
		STEP(forward)(ldl, panel, x, base, stride, 3, vectors);
	else if (panel->width == 2)
		STEP(forward)(ldl, panel, x, base, stride, 2, vectors);
	else
		STEP(forward)(ldl, panel, x, base, stride, 1, vectors);
}

INLINE void STEP(backward_any)(const struct ldl *ldl, const struct ldl_panel *panel, float *x, uint32_t base,
			       size_t stride, const unsigned vectors)
{
	if (panel->width == 4)
		STEP(backward)(ldl, panel, x, base, stride, 4, vectors);
	else if (panel->width == 3)
		STEP(backward)(ldl, panel, x, base, stride, 3, vectors);
	else if (panel->width == 2)
		STEP(backward)(ldl, panel, x, base, stride, 2, vectors);
	else
		STEP(backward)(ldl, panel, x, base, stride, 1, vectors);
}

#undef INLINE
#undef LANES
#undef STEP
