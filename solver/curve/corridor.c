/* A dynamic program over legs: best[j][k] is the least cost of a polygon from the first point whose last leg goes from
 * point j - 1 - k to point j. The price of the corner between two legs is known when both are, so legs are the states.
 */
#include "solver/curve/corridor.h"

#include <assert.h>
#include <stdint.h>

enum { WINDOW = CORRIDOR_WINDOW };

struct leg {
	double cost;   /* of the leg alone; INFINITY when it may not be used */
	double length; /* mm */
	double best;   /* least cost of a polygon that ends with it */
	struct vec2 direction;
	uint8_t before; /* which leg into its first point that polygon came by */
};

struct program {
	const struct corridor *corridor;
	struct leg (*into)[WINDOW]; /* [count] */
	double *run;                /* [count] length of the path up to each point */
	double *spent;              /* [count] cost of the path up to each point */
};

static bool within(const struct corridor *corridor, uint32_t i, uint32_t j)
{
	for (uint32_t m = i + 1; m < j; m++) {
		struct vec2 p = corridor->point[m], a = corridor->point[i], b = corridor->point[j];
		if (corridor->stop[m])
			return false;
		if (vec2_distance(p, vec2_mix(a, b, vec2_nearest(a, b, p))) > corridor->tolerance)
			return false;
	}
	return true;
}

static void measure_leg(struct program *program, uint32_t i, uint32_t j)
{
	const struct corridor *corridor = program->corridor;
	struct leg *leg = &program->into[j][j - 1 - i];
	leg->cost = leg->best = INFINITY;
	struct vec2 d = vec2_sub(corridor->point[j], corridor->point[i]);
	leg->length = vec2_length(d);
	leg->direction = vec2_unit(d);
	if (!within(corridor, i, j))
		return;
	double cost = corridor->leg_cost ? corridor->leg_cost(corridor->context, i, j) : INFINITY;
	bool own = corridor->leg_cost && (cost < INFINITY || j > i + 1);
	double run = program->run[j] - program->run[i];
	double rate = run > 0 ? (program->spent[j] - program->spent[i]) / run : corridor->rate[i];
	leg->cost = own ? cost : leg->length * rate;
}

/* What a corner costs. Of a leg that ends at a stop only half is for its arc, as of any other. */
static double corner_price(const struct corridor *corridor, const struct leg *in, const struct leg *out, double rate)
{
	double cosine = vec2_dot(in->direction, out->direction);
	double sine = fabs(vec2_cross(in->direction, out->direction));
	double half_tangent = 1 + cosine > 1e-9 ? sine / (1 + cosine) : 1e3;
	half_tangent = half_tangent > 1e3 ? 1e3 : half_tangent;
	double room = (in->length < out->length ? in->length : out->length) / 2;
	double lack = corridor->minimum_radius * half_tangent - room;
	double bend = corridor->bend_price * (1 + 4 * (1 - cosine));
	return rate * (bend + (lack > 0 ? 50 * lack : 0));
}

static void extend(struct program *program, uint32_t i, uint32_t j)
{
	const struct corridor *corridor = program->corridor;
	struct leg *leg = &program->into[j][j - 1 - i];
	if (leg->cost == INFINITY)
		return;
	if (i == 0) {
		leg->best = leg->cost;
		return;
	}
	uint32_t legs = i < WINDOW ? i : WINDOW;
	for (uint32_t k = 0; k < legs; k++) {
		const struct leg *in = &program->into[i][k];
		if (in->best == INFINITY)
			continue;
		double price = corner_price(corridor, in, leg, corridor->rate[i]);
		if (in->best + price + leg->cost < leg->best) {
			leg->best = in->best + price + leg->cost;
			leg->before = (uint8_t)k;
		}
	}
}

static void trace(const struct program *program, uint32_t *kept, uint32_t *kept_count)
{
	uint32_t at = program->corridor->count - 1, best = 0, count = 0;
	for (uint32_t k = 1; k < WINDOW && k < at; k++)
		if (program->into[at][k].best < program->into[at][best].best)
			best = k;
	for (uint32_t k = best; at > 0;) {
		const struct leg *leg = &program->into[at][k];
		assert(leg->best < INFINITY && k < at);
		kept[count++] = at;
		at -= k + 1;
		k = leg->before;
	}
	kept[count++] = 0;
	for (uint32_t i = 0; i < count / 2; i++) {
		uint32_t swap = kept[i];
		kept[i] = kept[count - 1 - i];
		kept[count - 1 - i] = swap;
	}
	*kept_count = count;
}

enum tw_status corridor_straighten(const struct corridor *corridor, struct arena *arena, uint32_t *kept,
				   uint32_t *kept_count, struct tw_error *error)
{
	struct arena_mark mark = arena_mark(arena);
	struct program program = {.corridor = corridor};
	assert(corridor->count >= 2);
	program.into = arena_array(arena, corridor->count, sizeof *program.into);
	program.run = ARENA_ARRAY(arena, corridor->count, double);
	program.spent = ARENA_ARRAY(arena, corridor->count, double);
	if (!program.into || !program.run || !program.spent)
		return tw_fail_memory(error);
	program.run[0] = program.spent[0] = 0;
	for (uint32_t j = 1; j < corridor->count; j++) {
		double step = vec2_distance(corridor->point[j - 1], corridor->point[j]);
		program.run[j] = program.run[j - 1] + step;
		program.spent[j] = program.spent[j - 1] + step * (corridor->rate[j - 1] + corridor->rate[j]) / 2;
		for (uint32_t i = j < WINDOW ? 0 : j - WINDOW; i < j; i++) {
			measure_leg(&program, i, j);
			extend(&program, i, j);
		}
	}
	trace(&program, kept, kept_count);
	arena_release(arena, mark);
	return TW_OK;
}
