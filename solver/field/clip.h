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

/* The parameters at which a side crosses a slab: entering and leaving. */
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

/* p + t d within [low, high]. A side that runs along the slab is as good as one that crosses it very slowly. */
static inline struct span slab_span(double p, double d, double low, double high)
{
	double inverse = 1 / (d == 0 ? 1e-100 : d);
	double a = (low - p) * inverse, b = (high - p) * inverse;
	return (struct span){clip_low(a, b), clip_high(a, b)};
}

/* A side against the box: its share of the area, and its part within. */
struct box_side {
	double area;
	struct span inside; /* positive length when in < out */
};

static inline struct box_side box_clip_side(const struct box *box, double px, double py, double qx, double qy)
{
	double dx = qx - px, dy = qy - py;
	struct span along = slab_span(px, dx, 0, box->length);
	struct span across = slab_span(py, dy, box->low, box->high);
	double begin = clip_high(along.in, 0), end = clip_low(along.out, 1);
	end = clip_high(begin, end);
	double in = clip_low(clip_high(across.in, begin), end), out = clip_low(clip_high(across.out, begin), end);
	double before = dy < 0 ? box->high : box->low, behind = dy < 0 ? box->low : box->high;
	double middle = py + 0.5 * dy * (in + out);
	double mean = before * (in - begin) + middle * (out - in) + behind * (end - out);
	return (struct box_side){-dx * mean, {in, out}};
}

/* The part of a segment within the polygon, as parameters (Cyrus and Beck 1978). */
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
