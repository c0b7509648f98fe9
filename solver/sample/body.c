/* The body is a smooth union of three sweeps (trunk, arm, leg), each a row of cross-sections along a straight axis as a
 * tailor's measures would give them: the centre and eight radii, 45 degrees apart. A radius between the eight is the
 * trigonometric polynomial through them, evaluated in cosine and sine of the direction (no angle is ever computed);
 * between two stations everything is a cubic Hermite curve. Muscles and hollows that the measures miss are smooth bumps
 * on top. The smooth union is the cubic one of I. Quilez, "Smooth minimum" (iquilezles.org/articles/smin). */
#include "solver/sample/body.h"

#define LENGTH_OF(array) ((int)(sizeof(array) / sizeof *(array)))

/* One cross-section: radii to the front, then every 45 degrees by way of the limb's side. mm */
struct station {
	double along;
	double side, front; /* centre of the section, off the axis */
	double radius[8];
};

/* The trunk is symmetric: front, front-side, side, back-side, back. */
struct trunk_station {
	double height;
	double front; /* centre */
	double radius[5];
};

static const struct trunk_station trunk_stations[] = {
	{812, -6, {54, 60, 66, 62, 54}},        {848, -6, {82, 101, 128, 116, 94}},
	{890, -4, {102, 128, 162, 146, 118}},   {930, -2, {110, 134, 174, 152, 124}},
	{980, 0, {112, 134, 168, 144, 114}},    {1030, 2, {111, 130, 158, 131, 102}},
	{1080, 4, {109, 126, 151, 123, 95}},    {1130, 4, {110, 127, 151, 124, 96}},
	{1180, 2, {115, 133, 156, 130, 104}},   {1230, -2, {121, 140, 163, 140, 114}},
	{1280, -6, {126, 147, 169, 149, 122}},  {1330, -11, {124, 146, 170, 153, 123}},
	{1375, -18, {109, 133, 166, 149, 115}}, {1410, -24, {90, 111, 150, 127, 99}},
	{1440, -29, {75, 92, 128, 104, 84}},    {1468, -32, {67, 74, 90, 80, 73}},
	{1495, -32, {62, 65, 70, 67, 65}},      {1550, -28, {60, 60, 61, 61, 62}},
};

/* From the shoulder joint to the wrist; side is up when the arm is level. */
static const struct station arm_stations[] = {
	{-95, -14, 0, {22, 22, 22, 22, 22, 22, 22, 22}}, {-40, -4, 0, {49, 49, 45, 49, 50, 48, 43, 46}},
	{0, 0, 0, {58, 60, 58, 60, 59, 56, 50, 55}},     {50, 0, 0, {57, 59, 58, 59, 57, 55, 52, 55}},
	{110, 0, 1, {53, 54, 52, 54, 54, 53, 51, 52}},   {170, 0, 2, {51, 50, 48, 50, 52, 51, 49, 51}},
	{230, 0, 3, {46, 45, 43, 45, 48, 47, 45, 46}},   {290, 0, 4, {41, 42, 41, 42, 43, 43, 42, 41}},
	{340, 0, 7, {42, 44, 43, 42, 41, 42, 43, 43}},   {400, 0, 11, {40, 41, 40, 38, 37, 37, 38, 40}},
	{460, 0, 15, {34, 34, 34, 32, 31, 31, 32, 33}},  {520, 0, 19, {28, 29, 30, 28, 26, 27, 29, 28}},
	{560, 0, 21, {25, 28, 30, 28, 25, 27, 29, 27}},  {620, 0, 24, {26, 30, 33, 30, 26, 30, 33, 30}},
};

/* From the hip joint to the ankle; side is outwards. */
static const struct station leg_stations[] = {
	{-60, -4, 0, {66, 68, 70, 68, 66, 64, 60, 62}},  {0, 0, 0, {88, 90, 88, 92, 94, 90, 84, 84}},
	{60, 0, 0, {93, 92, 88, 96, 100, 99, 97, 94}},   {120, 0, 0, {94, 92, 87, 92, 97, 98, 97, 95}},
	{200, 0, 0, {90, 89, 84, 86, 90, 90, 88, 89}},   {290, 0, 1, {84, 84, 80, 80, 82, 80, 75, 79}},
	{370, 0, 3, {72, 72, 69, 68, 69, 68, 66, 70}},   {440, 0, 4, {62, 62, 59, 60, 58, 61, 61, 62}},
	{490, 0, 0, {56, 57, 56, 58, 58, 59, 58, 56}},   {570, 0, -8, {53, 57, 61, 66, 68, 66, 60, 54}},
	{650, 0, -12, {45, 48, 52, 56, 58, 55, 50, 45}}, {740, 0, -14, {37, 38, 39, 41, 42, 40, 37, 37}},
	{820, 0, -14, {36, 34, 34, 38, 40, 38, 33, 34}}, {890, 0, -10, {38, 36, 36, 40, 42, 40, 36, 37}},
};

/* A muscle (or, below zero, a hollow): height (1 - q)^3 where q = (d/r)^2 < 1. mm */
struct bump {
	struct vec3 centre, radius;
	double height;
};

static const struct bump bumps[] = {
	{{80, 1322, 100}, {105, 90, 80}, 10}, /* pectoral */
	{{0, 1315, 118}, {34, 110, 60}, -4},  /* sternum */
	{{80, 880, -98}, {100, 100, 90}, 20}, /* glute */
	{{0, 868, -112}, {42, 105, 80}, -9},  /* between the glutes */
	{{88, 1355, -125}, {80, 90, 70}, 7},  /* shoulder blade */
	{{0, 1210, -92}, {40, 220, 65}, -6},  /* spine */
	{{225, 1385, -24}, {95, 95, 95}, 9},  /* deltoid */
	{{90, 1450, -48}, {110, 60, 80}, 3},  /* trapezius */
	{{150, 1285, -60}, {70, 120, 80}, 6}, /* latissimus */
	{{0, 1040, 108}, {100, 100, 70}, 3},  /* belly */
	{{0, 862, 88}, {70, 75, 70}, 9},      /* front of the crotch */
	{{128, 440, 62}, {48, 48, 48}, 5},    /* kneecap */
	{{330, 1275, 40}, {80, 65, 65}, 5},   /* biceps */
};

/* Union radii: how far a blend reaches. mm */
static const double blend_leg = 40, blend_arm = 50, blend_thighs = 44;

/* Centre and Fourier coefficients of one section. */
static void section_set(double value[SWEEP_COLUMNS], double side, double front, const double radius[8])
{
	const double h = sqrt(0.5);
	const double cosine[8] = {1, h, 0, -h, -1, -h, 0, h};
	value[0] = side;
	value[1] = front;
	for (int c = 2; c < SWEEP_COLUMNS; c++)
		value[c] = 0;
	for (int k = 0; k < 8; k++) {
		value[2] += radius[k] / 8;
		for (int order = 1; order <= 3; order++) {
			value[1 + 2 * order] += radius[k] * cosine[k * order % 8] / 4;
			value[2 + 2 * order] += radius[k] * cosine[(k * order + 6) % 8] / 4;
		}
		value[9] += (k % 2 ? -radius[k] : radius[k]) / 8;
	}
}

/* Slopes of the cubic through the stations: that of the parabola through each and its two neighbours. */
static void sweep_slopes(struct sweep *sweep)
{
	int last = sweep->station_count - 1;
	for (int i = 0; i <= last; i++) {
		int a = i > 0 ? i - 1 : i, b = i < last ? i + 1 : i;
		double left = i > 0 ? sweep->along[i] - sweep->along[a] : 1;
		double right = i < last ? sweep->along[b] - sweep->along[i] : 1;
		for (int c = 0; c < SWEEP_COLUMNS; c++) {
			double back = (sweep->value[i][c] - sweep->value[a][c]) / left;
			double ahead = (sweep->value[b][c] - sweep->value[i][c]) / right;
			sweep->slope[i][c] = i == 0      ? ahead
					     : i == last ? back
							 : (back * right + ahead * left) / (left + right);
		}
	}
}

static void sweep_init(struct sweep *sweep, const struct station *stations, int count)
{
	sweep->station_count = count;
	for (int i = 0; i < count; i++) {
		sweep->along[i] = stations[i].along;
		section_set(sweep->value[i], stations[i].side, stations[i].front, stations[i].radius);
	}
	sweep_slopes(sweep);
}

static void trunk_init(struct sweep *sweep)
{
	struct station stations[LENGTH_OF(trunk_stations)];
	for (int i = 0; i < LENGTH_OF(trunk_stations); i++) {
		const struct trunk_station *t = &trunk_stations[i];
		stations[i] = (struct station){.along = t->height, .side = 0, .front = t->front};
		for (int k = 0; k < 8; k++)
			stations[i].radius[k] = t->radius[k <= 4 ? k : 8 - k];
	}
	sweep_init(sweep, stations, LENGTH_OF(trunk_stations));
}

void body_init(struct body *body)
{
	struct sweep *trunk = &body->part[BODY_TORSO], *arm = &body->part[BODY_SLEEVE], *leg = &body->part[BODY_LEG];
	*trunk = (struct sweep){.axis = {0, 1, 0}, .side = {1, 0, 0}, .front = {0, 0, 1}};
	trunk_init(trunk);
	*arm = (struct sweep){
		.origin = {184, 1384, -26}, .axis = {0.8, -0.6, 0}, .side = {0.6, 0.8, 0}, .front = {0, 0, 1}};
	sweep_init(arm, arm_stations, LENGTH_OF(arm_stations));
	struct vec3 down = vec3_unit((struct vec3){72, -830, 0});
	*leg = (struct sweep){.origin = {96, 920, -2}, .axis = down, .side = {-down.y, down.x, 0}, .front = {0, 0, 1}};
	sweep_init(leg, leg_stations, LENGTH_OF(leg_stations));
}

/* All columns at `along`, which is clamped to the stations. */
static double sweep_section(const struct sweep *sweep, double along, double section[SWEEP_COLUMNS])
{
	int last = sweep->station_count - 1;
	double t = along < sweep->along[0] ? sweep->along[0] : along > sweep->along[last] ? sweep->along[last] : along;
	int i = 0;
	while (i < last - 1 && t > sweep->along[i + 1])
		i++;
	double width = sweep->along[i + 1] - sweep->along[i], s = (t - sweep->along[i]) / width;
	double h1 = s * s * (3 - 2 * s), h0 = 1 - h1;
	double g0 = s * (1 - s) * (1 - s) * width, g1 = -s * s * (1 - s) * width;
	for (int c = 0; c < SWEEP_COLUMNS; c++)
		section[c] = h0 * sweep->value[i][c] + h1 * sweep->value[i + 1][c] + g0 * sweep->slope[i][c] +
			     g1 * sweep->slope[i + 1][c];
	return t;
}

/* Radius of a section in the direction (c, s) = (cosine, sine). */
static double section_radius(const double section[SWEEP_COLUMNS], double c, double s)
{
	double c2 = c * c - s * s, s2 = 2 * c * s;
	double c3 = c2 * c - s2 * s, s3 = s2 * c + c2 * s;
	double c4 = c2 * c2 - s2 * s2;
	return section[2] + section[3] * c + section[4] * s + section[5] * c2 + section[6] * s2 + section[7] * c3 +
	       section[8] * s3 + section[9] * c4;
}

/* Distance to a sweep, along its cross-sections; beyond its ends, to a round cap. */
static double sweep_distance(const struct sweep *sweep, struct vec3 p)
{
	struct vec3 d = vec3_sub(p, sweep->origin);
	double section[SWEEP_COLUMNS], along = vec3_dot(d, sweep->axis);
	double beyond = along - sweep_section(sweep, along, section);
	double side = vec3_dot(d, sweep->side) - section[0];
	double front = vec3_dot(d, sweep->front) - section[1];
	double r = sqrt(side * side + front * front);
	double radius = r > 1e-9 ? section_radius(section, front / r, side / r) : section[2];
	/* The cap is half an ellipsoid on the section, 0.4 of its mean radius deep. */
	double share = r / radius, depth = beyond / (0.4 * section[2]);
	return radius * (sqrt(share * share + depth * depth) - 1);
}

static double smooth_min(double a, double b, double reach)
{
	double h = reach - fabs(a - b), least = a < b ? a : b;
	if (h <= 0)
		return least;
	h /= reach;
	return least - h * h * h * reach / 6;
}

static double bump_height(const struct bump *bump, struct vec3 p)
{
	if (fabs(p.y - bump->centre.y) >= bump->radius.y)
		return 0;
	double y = (p.y - bump->centre.y) / bump->radius.y;
	double x = (p.x - bump->centre.x) / bump->radius.x;
	double z = (p.z - bump->centre.z) / bump->radius.z;
	double rest = 1 - x * x - y * y - z * z;
	return rest > 0 ? bump->height * rest * rest * rest : 0;
}

/* p.x >= 0. A bump that reaches across the plane of symmetry meets its mirror image there. */
static double bumps_height(struct vec3 p)
{
	double height = 0;
	for (int i = 0; i < LENGTH_OF(bumps); i++) {
		height += bump_height(&bumps[i], p);
		if (bumps[i].centre.x > 0 && p.x < bumps[i].radius.x - bumps[i].centre.x)
			height += bump_height(&bumps[i], (struct vec3){-p.x, p.y, p.z});
	}
	return height;
}

double body_distance(const struct body *body, struct vec3 p)
{
	p.x = fabs(p.x);
	double d = 1e3;
	if (p.y > 600 && p.x < 400)
		d = sweep_distance(&body->part[BODY_TORSO], p);
	if (p.y < 1150) {
		double leg = sweep_distance(&body->part[BODY_LEG], p);
		if (p.x < 120) {
			double other = sweep_distance(&body->part[BODY_LEG], (struct vec3){-p.x, p.y, p.z});
			leg = smooth_min(leg, other, blend_thighs);
		}
		d = smooth_min(d, leg, blend_leg);
	}
	if (p.x > 20 && p.y > 900)
		d = smooth_min(d, sweep_distance(&body->part[BODY_SLEEVE], p), blend_arm);
	return d - bumps_height(p);
}

static double smooth_step(double from, double to, double x)
{
	double t = (x - from) / (to - from);
	t = t < 0 ? 0 : t > 1 ? 1 : t;
	return t * t * (3 - 2 * t);
}

/* z of the line that parts front and back: the middle of each limb, blended at shoulder and hip. */
static double side_line(const struct body *body, struct vec3 p)
{
	double section[SWEEP_COLUMNS];
	const struct sweep *leg = &body->part[BODY_LEG], *arm = &body->part[BODY_SLEEVE];
	sweep_section(&body->part[BODY_TORSO], p.y, section);
	double z = section[1];
	double below = smooth_step(900, 780, p.y), out = smooth_step(130, 240, p.x) * smooth_step(900, 1000, p.y);
	if (below > 0) {
		sweep_section(leg, vec3_dot(vec3_sub(p, leg->origin), leg->axis), section);
		z += below * (leg->origin.z + section[1] - z);
	}
	if (out > 0) {
		sweep_section(arm, vec3_dot(vec3_sub(p, arm->origin), arm->axis), section);
		z += out * (arm->origin.z + section[1] - z);
	}
	return z;
}

/* The armhole halves the angle between flank and arm at the armpit, that between shoulder and arm at the top, and is
 * scooped in front and behind: a hyperbola, bent. */
static double armhole_side(struct vec3 p)
{
	double rise = p.y - 1384, scoop = p.z + 26, root = sqrt(rise * rise + 60 * 60), slope = 0.8 * rise / root;
	double line = 164 + 0.8 * (root - 60) - 0.0012 * scoop * scoop;
	return (p.x - line) / sqrt(1 + slope * slope);
}

double body_cut_side(const struct body *body, enum body_cut cut, struct vec3 p)
{
	const struct sweep *arm = &body->part[BODY_SLEEVE];
	switch (cut) {
	case CUT_CENTRE:
		return p.x;
	case CUT_NECK:
		return p.x > 115 ? -1 : (p.y - 1486 + 0.42 * (p.z + 30)) / 1.0846;
	case CUT_WRIST:
		return p.x < 350 ? -1 : vec3_dot(vec3_sub(p, arm->origin), arm->axis) - 545;
	case CUT_ANKLE:
		return 98 - p.y;
	case CUT_ARMHOLE:
		return armhole_side(p);
	case CUT_WAIST:
		return p.x > 320 ? -1 : 1062 + 0.06 * p.z - p.y;
	case CUT_SIDE:
		return side_line(body, p) - p.z;
	case CUT_COUNT:
		break;
	}
	return -1;
}

/* A function's value and gradient at p, by one-sided differences. */
static struct vec3 slope_of(const struct body *body, int cut, struct vec3 p, double *value)
{
	const double step = 1e-3;
	double at[4];
	for (int k = 0; k < 4; k++) {
		struct vec3 q = {p.x + (k == 1 ? step : 0), p.y + (k == 2 ? step : 0), p.z + (k == 3 ? step : 0)};
		at[k] = cut < 0 ? body_distance(body, q) : body_cut_side(body, (enum body_cut)cut, q);
	}
	*value = at[0];
	return (struct vec3){(at[1] - at[0]) / step, (at[2] - at[0]) / step, (at[3] - at[0]) / step};
}

/* Solves the symmetric system a x = b of `n` rows by elimination; rows without a pivot give 0. */
static void solve_small(int n, double a[3][3], double b[3])
{
	for (int i = 0; i < n; i++) {
		for (int k = i + 1; k < n; k++) {
			double m = a[i][i] > 1e-12 ? a[k][i] / a[i][i] : 0;
			for (int j = i; j < n; j++)
				a[k][j] -= m * a[i][j];
			b[k] -= m * b[i];
		}
	}
	for (int i = n - 1; i >= 0; i--) {
		for (int j = i + 1; j < n; j++)
			b[i] -= a[i][j] * b[j];
		b[i] = a[i][i] > 1e-12 ? b[i] / a[i][i] : 0;
	}
}

struct vec3 body_project(const struct body *body, unsigned cuts, struct vec3 p)
{
	for (int round = 0; round < 8; round++) {
		struct vec3 slope[3];
		double value[3], product[3][3], worst;
		int n = 1;
		slope[0] = slope_of(body, -1, p, &value[0]);
		worst = fabs(value[0]);
		for (int cut = 0; cut < CUT_COUNT && n < 3; cut++) {
			if (!(cuts & 1u << cut))
				continue;
			slope[n] = slope_of(body, cut, p, &value[n]);
			worst = fabs(value[n]) > worst ? fabs(value[n]) : worst;
			n++;
		}
		for (int i = 0; i < n; i++)
			for (int j = 0; j < n; j++)
				product[i][j] = vec3_dot(slope[i], slope[j]);
		solve_small(n, product, value);
		for (int i = 0; i < n; i++)
			p = vec3_step(p, slope[i], -value[i]);
		/* The error is squared in every round: this one has made it too small to see. */
		if (worst < 1e-3)
			break;
	}
	if (cuts & 1u << CUT_CENTRE)
		p.x = 0;
	return p;
}

struct vec3 body_skin_point(const struct body *body, enum body_part part, double along, double side, double front)
{
	const struct sweep *sweep = &body->part[part];
	double section[SWEEP_COLUMNS], inside = 0, outside = 400;
	sweep_section(sweep, along, section);
	struct vec3 start = vec3_step(sweep->origin, sweep->axis, along);
	start = vec3_step(vec3_step(start, sweep->side, section[0]), sweep->front, section[1]);
	struct vec3 ray = vec3_unit(vec3_add(vec3_scale(sweep->side, side), vec3_scale(sweep->front, front)));
	/* The skin is the first change of sign; coarse steps find it, halving makes it exact. */
	for (int step = 1; step <= 100; step++)
		if (body_distance(body, vec3_step(start, ray, 4.0 * step)) > 0) {
			outside = 4.0 * step;
			inside = outside - 4;
			break;
		}
	for (int i = 0; i < 40; i++) {
		double middle = 0.5 * (inside + outside);
		if (body_distance(body, vec3_step(start, ray, middle)) > 0)
			outside = middle;
		else
			inside = middle;
	}
	return vec3_step(start, ray, inside);
}

struct vec3 body_normal(const struct body *body, struct vec3 p)
{
	double value;
	return vec3_unit(slope_of(body, -1, p, &value));
}

struct vec3 body_upward(const struct body *body, enum body_part part)
{
	struct vec3 axis = body->part[part].axis;
	return part == BODY_TORSO ? axis : vec3_scale(axis, -1);
}
