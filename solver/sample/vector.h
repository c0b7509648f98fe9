/* Points and directions by value. Only + - * / and sqrt, which IEEE 754 fixes to the last bit, so that whatever is
 * built on them is the same on every machine. */
#ifndef SOLVER_SAMPLE_VECTOR_H
#define SOLVER_SAMPLE_VECTOR_H

#include <math.h>

struct vec3 {
	double x, y, z;
};

static inline struct vec3 vec3_add(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline struct vec3 vec3_sub(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline struct vec3 vec3_scale(struct vec3 a, double s)
{
	return (struct vec3){a.x * s, a.y * s, a.z * s};
}

/* a + s b */
static inline struct vec3 vec3_step(struct vec3 a, struct vec3 b, double s)
{
	return (struct vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline struct vec3 vec3_middle(struct vec3 a, struct vec3 b)
{
	return (struct vec3){0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z)};
}

static inline double vec3_dot(struct vec3 a, struct vec3 b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vec3 vec3_cross(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_length(struct vec3 a)
{
	return sqrt(vec3_dot(a, a));
}

/* Squared distance. */
static inline double vec3_apart(struct vec3 a, struct vec3 b)
{
	struct vec3 d = vec3_sub(b, a);
	return vec3_dot(d, d);
}

/* The zero vector stays zero. */
static inline struct vec3 vec3_unit(struct vec3 a)
{
	double length = vec3_length(a);
	return length > 0 ? vec3_scale(a, 1 / length) : a;
}

/* Normal of a triangle, as long as twice its area. */
static inline struct vec3 vec3_normal(struct vec3 a, struct vec3 b, struct vec3 c)
{
	return vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
}

#endif
