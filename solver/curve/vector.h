/* Vectors of the pattern plane, and the few angle functions that curves need. Only + - * / and sqrt are used, which
 * IEEE 754 fixes to the last bit, so that curves are the same bytes on every machine; libm's sin and atan2 are not. */
#ifndef SOLVER_CURVE_VECTOR_H
#define SOLVER_CURVE_VECTOR_H

#include <math.h>

#define CURVE_PI 3.14159265358979323846

struct vec2 {
	double x, y;
};

static inline struct vec2 vec2_add(struct vec2 a, struct vec2 b)
{
	return (struct vec2){a.x + b.x, a.y + b.y};
}

static inline struct vec2 vec2_sub(struct vec2 a, struct vec2 b)
{
	return (struct vec2){a.x - b.x, a.y - b.y};
}

static inline struct vec2 vec2_scale(struct vec2 a, double factor)
{
	return (struct vec2){a.x * factor, a.y * factor};
}

/* a + factor * b */
static inline struct vec2 vec2_along(struct vec2 a, struct vec2 b, double factor)
{
	return (struct vec2){a.x + factor * b.x, a.y + factor * b.y};
}

static inline struct vec2 vec2_mix(struct vec2 a, struct vec2 b, double t)
{
	return (struct vec2){a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
}

static inline double vec2_dot(struct vec2 a, struct vec2 b)
{
	return a.x * b.x + a.y * b.y;
}

/* Positive when b points to the left of a. */
static inline double vec2_cross(struct vec2 a, struct vec2 b)
{
	return a.x * b.y - a.y * b.x;
}

static inline double vec2_length(struct vec2 a)
{
	return sqrt(vec2_dot(a, a));
}

static inline double vec2_distance(struct vec2 a, struct vec2 b)
{
	return vec2_length(vec2_sub(a, b));
}

/* The direction of a; x where a is zero. */
static inline struct vec2 vec2_unit(struct vec2 a)
{
	double length = vec2_length(a);
	return length > 0 ? vec2_scale(a, 1 / length) : (struct vec2){1, 0};
}

/* a turned by a quarter to the left. */
static inline struct vec2 vec2_left(struct vec2 a)
{
	return (struct vec2){-a.y, a.x};
}

/* a turned by the angle of the unit vector `rotation` (a complex product). */
static inline struct vec2 vec2_rotate(struct vec2 a, struct vec2 rotation)
{
	return (struct vec2){a.x * rotation.x - a.y * rotation.y, a.x * rotation.y + a.y * rotation.x};
}

/* The unit vector at `angle` radians, |angle| <= 2 pi. */
struct vec2 vec2_of_angle(double angle);

/* The angle from a to b, -pi…pi, positive to the left. Neither may be zero. */
double vec2_angle(struct vec2 a, struct vec2 b);

/* The point of the segment a b that is nearest to p, as its parameter 0…1. */
double vec2_nearest(struct vec2 a, struct vec2 b, struct vec2 p);

/* A rigid motion of the plane: p becomes rotation * p + shift. */
struct placement {
	struct vec2 rotation; /* unit */
	struct vec2 shift;
};

#define PLACEMENT_IDENTITY ((struct placement){{1, 0}, {0, 0}})

static inline struct vec2 placement_apply(struct placement p, struct vec2 a)
{
	return vec2_add(vec2_rotate(a, p.rotation), p.shift);
}

static inline struct vec2 placement_undo(struct placement p, struct vec2 a)
{
	struct vec2 back = {p.rotation.x, -p.rotation.y};
	return vec2_rotate(vec2_sub(a, p.shift), back);
}

#endif
