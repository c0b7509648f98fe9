/* The wearer's body as a smooth implicit surface, and the lines along which a tailor cuts a suit on it. Size L; other
 * sizes are this one scaled (suit.c). Millimetres, y up from the floor, +z forward, +x to the wearer's left; only x >=
 * 0 is described, the other half is its mirror image. */
#ifndef SOLVER_SAMPLE_BODY_H
#define SOLVER_SAMPLE_BODY_H

#include "solver/sample/vector.h"

enum body_part { BODY_TORSO, BODY_SLEEVE, BODY_LEG, BODY_PARTS };

/* Surfaces that cut the body: the plane of symmetry, the openings, and the seams. */
enum body_cut {
	CUT_CENTRE,  /* centre front and centre back, x = 0 */
	CUT_NECK,    /* opening */
	CUT_WRIST,   /* opening */
	CUT_ANKLE,   /* opening */
	CUT_ARMHOLE, /* torso | sleeve */
	CUT_WAIST,   /* leg | torso */
	CUT_SIDE,    /* back | front: shoulder, sleeve top, underarm, side, outseam, inseam */
	CUT_COUNT,
};

/* The room a limb's tables take: rows of a centre and eight radii, as cubic curves (see body.c). */
enum { SWEEP_STATIONS = 20, SWEEP_COLUMNS = 10 };

struct sweep {
	struct vec3 origin, axis, side, front; /* orthonormal; `along` is measured from origin */
	int station_count;
	double along[SWEEP_STATIONS];                /* mm, increasing */
	double value[SWEEP_STATIONS][SWEEP_COLUMNS]; /* centre (side, front), Fourier coefficients of the radius */
	double slope[SWEEP_STATIONS][SWEEP_COLUMNS]; /* per mm along */
};

struct body {
	struct sweep part[BODY_PARTS];
};

void body_init(struct body *body);

/* Negative inside, 0 on the skin, close to the distance in mm near it; smooth. x may have either sign. */
double body_distance(const struct body *body, struct vec3 p);

/* Which side of a cut p lies on: positive on the first named side above (or beyond the opening), 0 on the cut. Close to
 * a distance near the cut; far away, where a cut has no meaning, it has a constant sign. */
double body_cut_side(const struct body *body, enum body_cut cut, struct vec3 p);

/* Moves p to the skin, and onto every cut of the set `cuts` (bits 1 << enum body_cut, at most two) by Newton's method;
 * the shortest move to first order. p must be near. */
struct vec3 body_project(const struct body *body, unsigned cuts, struct vec3 p);

/* The point where a ray from the limb's axis leaves the body: `along` mm from the part's origin, in the direction
 * side * `side` + front * `front`. */
struct vec3 body_skin_point(const struct body *body, enum body_part part, double along, double side, double front);

/* Outward unit normal at p. */
struct vec3 body_normal(const struct body *body, struct vec3 p);

/* Unit direction, along the limb towards its root, in which a pattern piece of this part stands upright. */
struct vec3 body_upward(const struct body *body, enum body_part part);

#endif
