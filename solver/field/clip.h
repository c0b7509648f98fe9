/* Triangles against a strip: the two shapes that a strip can have and what the walk asks of them. A triangle is
 * x[3], y[3] in the shape's own plane, counter-clockwise; side k runs from corner k to corner (k + 1) % 3.
 *
 *     area    of the triangle within the shape
 *     inside  the part of side k within the shape, as parameters from corner k on; empty where out <= in
 *
 * A box is [0, length] x [low, high]. Its area needs no polygon: by Green's theorem the area of a triangle within it is
 * the sum over sides of the integral of -clamp(y, low, high) dx over [0, length], where each side is a straight line
 * cut at four parameters. A convex polygon is clipped the classical way (Sutherland and Hodgman 1974). */
#ifndef SOLVER_FIELD_CLIP_H
#define SOLVER_FIELD_CLIP_H

#include <stdbool.h>
#include <stdint.h>

struct box {
	double length, low, high;
};

enum { CONVEX_CORNERS = 8 };

/* Counter-clockwise. */
struct convex {
	uint32_t count;
	double x[CONVEX_CORNERS], y[CONVEX_CORNERS];
};

/* The part of a side within a shape, as parameters: entering and leaving. */
struct span {
	double in, out;
};

static inline double clip_low(double a, double b)
{
	return a < b ? a : b;
}

static inline double clip_high(double a, double b)
{
	return a > b ? a : b;
}

/* The three sides of a triangle side by side, and a fourth lane that only fills the vector. */
typedef double four __attribute__((vector_size(32)));
typedef int64_t four_mask __attribute__((vector_size(32)));

#define FOUR_PICK(mask, a, b) ((four)(((mask) & (four_mask)(a)) | (~(mask) & (four_mask)(b))))
#define FOUR_LOW(a, b) FOUR_PICK((a) < (b), a, b)
#define FOUR_HIGH(a, b) FOUR_PICK((a) > (b), a, b)

struct sides {
	four share;  /* of the area, with its sign */
	four inside; /* length of the part within, as a share of the side; 0 when outside */
	four middle; /* parameter of that part's middle */
};

/* Corners x, y; a side that runs along a slab is as good as one that crosses it very slowly: 1e-100 for 0. */
static inline __attribute__((always_inline)) void box_clip_sides(const struct box *box, const four *x, const four *y,
								 struct sides *sides)
{
	const four zero = {0}, one = {1, 1, 1, 1}, crawl = {1e-100, 1e-100, 1e-100, 1e-100};
	const four length = zero + box->length, low = zero + box->low, high = zero + box->high;
	const four px = *x, py = *y;
	const four dx = __builtin_shufflevector(px, px, 1, 2, 0, 0) - px;
	const four dy = __builtin_shufflevector(py, py, 1, 2, 0, 0) - py;
	const four_mask back = dx < zero, down = dy < zero;
	const four enter = FOUR_PICK(back, length, zero), leave = FOUR_PICK(back, zero, length);
	const four before = FOUR_PICK(down, high, low), behind = FOUR_PICK(down, low, high);
	const four per_dx = one / FOUR_PICK(dx == zero, crawl, dx), per_dy = one / FOUR_PICK(dy == zero, crawl, dy);
	const four entering = (enter - px) * per_dx, leaving = (leave - px) * per_dx;
	const four rising = (before - py) * per_dy, passing = (behind - py) * per_dy;
	const four begin = FOUR_HIGH(entering, zero);
	const four cut = FOUR_LOW(leaving, one), end = FOUR_HIGH(cut, begin);
	const four risen = FOUR_HIGH(rising, begin), in = FOUR_LOW(risen, end);
	const four passed = FOUR_HIGH(passing, begin), out = FOUR_LOW(passed, end);
	const four half = (in + out) * 0.5;
	sides->share = -dx * (before * (in - begin) + (py + dy * half) * (out - in) + behind * (end - out));
	sides->inside = out - in;
	sides->middle = half;
}

/* The part of a segment within the polygon (Cyrus and Beck 1978). */
static inline struct span convex_clip_side(const struct convex *shape, double px, double py, double qx, double qy)
{
	struct span span = {0, 1};
	for (uint32_t i = 0; i < shape->count; i++) {
		uint32_t j = i + 1 < shape->count ? i + 1 : 0;
		double nx = shape->y[i] - shape->y[j], ny = shape->x[j] - shape->x[i]; /* inwards */
		double p = nx * (px - shape->x[i]) + ny * (py - shape->y[i]);
		double q = nx * (qx - shape->x[i]) + ny * (qy - shape->y[i]);
		if (p <= 0 && q <= 0)
			return (struct span){1, 0};
		if (p < 0)
			span.in = clip_high(span.in, p / (p - q));
		else if (q < 0)
			span.out = clip_low(span.out, p / (p - q));
	}
	return span;
}

static inline double convex_area(uint32_t count, const double *x, const double *y)
{
	double twice = 0;
	for (uint32_t i = 1; i + 1 < count; i++)
		twice += (x[i] - x[0]) * (y[i + 1] - y[0]) - (x[i + 1] - x[0]) * (y[i] - y[0]);
	return 0.5 * twice;
}

/* The area of a triangle within the polygon. */
static inline double convex_clip_area(const struct convex *shape, const double tx[3], const double ty[3])
{
	enum { ROOM = CONVEX_CORNERS + 3 };
	double x[2][ROOM], y[2][ROOM];
	uint32_t count = 3, from = 0;
	for (uint32_t k = 0; k < 3; k++) {
		x[0][k] = tx[k];
		y[0][k] = ty[k];
	}
	for (uint32_t i = 0; i < shape->count; i++) {
		uint32_t j = i + 1 < shape->count ? i + 1 : 0, kept = 0, to = !from;
		double nx = shape->y[i] - shape->y[j], ny = shape->x[j] - shape->x[i];
		for (uint32_t k = 0; k < count; k++) {
			uint32_t l = k + 1 < count ? k + 1 : 0;
			double p = nx * (x[from][k] - shape->x[i]) + ny * (y[from][k] - shape->y[i]);
			double q = nx * (x[from][l] - shape->x[i]) + ny * (y[from][l] - shape->y[i]);
			if (p >= 0 && kept < ROOM) {
				x[to][kept] = x[from][k];
				y[to][kept++] = y[from][k];
			}
			if ((p > 0) != (q > 0) && p != 0 && q != 0 && kept < ROOM) {
				double t = p / (p - q);
				x[to][kept] = x[from][k] + t * (x[from][l] - x[from][k]);
				y[to][kept++] = y[from][k] + t * (y[from][l] - y[from][k]);
			}
		}
		count = kept;
		from = to;
	}
	return count < 3 ? 0 : convex_area(count, x[from], y[from]);
}

#endif
