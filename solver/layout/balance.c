/* Deformation E and covered area B of a tree add up to its weight E + eta B, so the best trees for all eta are the
 * lower envelope of straight lines, and between two of them the next candidate is the eta at which both weigh the same:
 * where no third tree is lighter, the envelope has its corner there (M. J. Eisner & D. G. Severance, Mathematical
 * techniques for efficient record segmentation in large shared databases, JACM 1976). Length falls and deformation
 * rises from corner to corner; the corner at which the normalised curves change places is closed in upon from both
 * ends, the tree of eta = 0 and the shortest one, so that the answer depends on no range that anybody chose. */
#include "solver/layout/pricing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At most. Seven to eleven were needed on suits of 3,057 and 23,729 vertices, with 10 to 36 terminals. */
enum { SEARCHES = 14 };

/* Of a weight: what is lighter by less is no other tree, but rounding. */
#define LIGHTER 1e-6

struct balance {
	struct arena *arena;
	const struct ground *ground;
	const struct site_set *sites;
	const struct pricing *bare; /* weighed with eta = 0 */
	void (*progress)(void *context, double share);
	void *context;
	int searches_done;
};

struct outcome {
	double length; /* rest length, mm */
	double energy; /* weight at eta = 0, MPa mm2 */
	double area;   /* what a unit of eta adds to it, mm2; NAN for the shortest tree until it is asked for */
	double side;   /* normalised length less normalised energy: 1 at eta = 0, -1 of the shortest tree */
};

/* Of an edge on a seam the mean of its two sides. */
static double edge_length(const struct pricing *pricing, uint32_t edge)
{
	const struct network *network = &pricing->network;
	struct laid_edge laid[2];
	if (edge >= network->graph.edge_count)
		return pricing->chords.length_mm[edge - network->graph.edge_count];
	uint32_t sides = network_lay(network, edge, network->graph.ends[2 * (size_t)edge], laid);
	double sum = 0;
	for (uint32_t i = 0; i < sides; i++)
		sum += vec2_distance(laid[i].from, laid[i].to) / sides;
	return sum;
}

static void pass_progress(void *context, const struct steiner_progress *progress)
{
	const struct balance *balance = context;
	balance->progress(balance->context, (balance->searches_done + pricing_solved(progress)) / SEARCHES);
}

static enum tw_status search(struct balance *balance, const struct pricing *pricing, const struct graph *graph,
			     struct steiner_tree *tree, struct tw_error *error)
{
	const struct pricing_search search = {
		.graph = graph, .time_share = 1.0 / SEARCHES, .progress = pass_progress, .context = balance};
	enum tw_status status = pricing_solve(pricing, balance->arena, &balance->ground->input, &search, tree, error);
	balance->searches_done++;
	balance->progress(balance->context, (double)balance->searches_done / SEARCHES);
	return status;
}

/* `unit`: the weights with eta = 1, of which those with eta = 0 are taken off. */
static void measure(const struct balance *balance, const struct steiner_tree *tree, const struct pricing *unit,
		    struct outcome *outcome)
{
	*outcome = (struct outcome){0};
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		uint32_t e = tree->edges[i];
		double bare = (double)balance->bare->graph->weight[e] / balance->bare->field->scale;
		outcome->length += edge_length(balance->bare, e);
		outcome->energy += bare;
		outcome->area += (double)unit->graph->weight[e] / unit->field->scale - bare;
	}
}

/* The shortest tree: no eta is large enough to be sure of it. */
static enum tw_status find_shortest(struct balance *balance, const struct pricing *unit, struct outcome *outcome,
				    struct tw_error *error)
{
	struct arena_mark mark = arena_mark(balance->arena);
	struct graph graph = *unit->graph;
	struct steiner_tree tree;
	uint64_t *weight = ARENA_ARRAY(balance->arena, graph.edge_count, uint64_t);
	for (uint32_t e = 0; weight && e < graph.edge_count; e++)
		weight[e] = (uint64_t)(edge_length(unit, e) * 1024 + 0.5);
	graph.weight = weight;
	enum tw_status status = weight ? search(balance, unit, &graph, &tree, error) : tw_fail_memory(error);
	if (status == TW_OK)
		measure(balance, &tree, unit, outcome);
	arena_release(balance->arena, mark);
	return status;
}

static enum tw_status find_best(struct balance *balance, double eta, const struct pricing *unit,
				struct outcome *outcome, struct tw_error *error)
{
	struct arena_mark mark = arena_mark(balance->arena);
	struct pricing pricing;
	struct steiner_tree tree;
	enum tw_status status = pricing_build(&pricing, balance->arena, balance->ground, balance->sites, eta, error);
	if (status == TW_OK)
		status = search(balance, &pricing, pricing.graph, &tree, error);
	if (status == TW_OK)
		measure(balance, &tree, unit, outcome);
	arena_release(balance->arena, mark);
	return status;
}

/* Three digits say enough, and look like a choice rather than noise; towards the tree that is wanted. In decimals, as
 * it will be written, so that it is the same number everywhere. */
static double round_digits(double value, bool down)
{
	char text[32];
	snprintf(text, sizeof text, "%.2e", value);
	const double nearest = strtod(text, NULL);
	if (down ? nearest <= value : nearest >= value)
		return nearest;
	long digits = (text[0] - '0') * 100L + (text[2] - '0') * 10L + (text[3] - '0') + (down ? -1 : 1);
	snprintf(text, sizeof text, "%lde%ld", digits, strtol(strchr(text, 'e') + 1, NULL, 10) - 2);
	return strtod(text, NULL);
}

/* Between two trees, of which the one is too long and the other too dear. */
static enum tw_status close_in(struct balance *balance, const struct pricing *unit, struct outcome low,
			       struct outcome high, double *eta, struct tw_error *error)
{
	const double length_fall = low.length - high.length, energy_rise = high.energy - low.energy;
	const struct outcome ends[2] = {low, high};
	/* Where eta changes nothing, the field's own is as good as any. */
	if (!(length_fall > 0) || !(energy_rise > 0))
		return TW_OK;
	low.side = 1, high.side = -1;
	while (balance->searches_done < SEARCHES && low.area > high.area) {
		const double corner = (high.energy - low.energy) / (low.area - high.area);
		struct outcome here;
		enum tw_status status = find_best(balance, corner, unit, &here, error);
		if (status != TW_OK)
			return status;
		*eta = round_digits(corner, low.side < -high.side);
		if (here.energy + corner * here.area >= (low.energy + corner * low.area) * (1 - LIGHTER))
			break;
		here.side = (here.length - ends[1].length) / length_fall - (here.energy - ends[0].energy) / energy_rise;
		*(here.side > 0 ? &low : &high) = here;
	}
	return TW_OK;
}

static double mean_density(const struct field *field)
{
	double sum = 0;
	for (uint32_t f = 0; f < field->face_count; f++)
		sum += field->density[f];
	return field->face_count ? sum / field->face_count : 0;
}

enum tw_status pricing_balance(double *eta_mpa, struct arena *arena, const struct ground *ground,
			       const struct site_set *sites, void (*progress)(void *context, double share),
			       void *context, struct tw_error *error)
{
	const struct field *field = &ground->base->field;
	*eta_mpa = field->options.eta_mpa;
	if (!(mean_density(field) > 0) || field->options.weight != FIELD_DEFORMATION)
		return TW_OK;
	struct arena_mark mark = arena_mark(arena);
	struct pricing bare, unit;
	struct outcome low = {0}, high = {0};
	enum tw_status status = pricing_build(&bare, arena, ground, sites, 0, error);
	if (status == TW_OK)
		status = pricing_build(&unit, arena, ground, sites, 1, error);
	struct balance balance = {.arena = arena,
				  .ground = ground,
				  .sites = sites,
				  .bare = &bare,
				  .progress = progress,
				  .context = context};
	if (status == TW_OK)
		status = find_best(&balance, 0, &unit, &low, error);
	if (status == TW_OK)
		status = find_shortest(&balance, &unit, &high, error);
	if (status == TW_OK)
		status = close_in(&balance, &unit, low, high, eta_mpa, error);
	arena_release(arena, mark);
	return status;
}
