/* Length and deformation of the best tree are step functions of eta, falling and rising. Their normalised difference
 * falls from 1 to -1 between two extremes of eta; the place where it is nearest to zero is found by halving on a
 * logarithmic scale. */
#include "solver/layout/pricing.h"

#include <stdlib.h>

enum { HALVINGS = 5, SEARCHES = HALVINGS + 2 };
static const double extreme = 100; /* eta from a hundredth to a hundredfold of the mean density */

struct balance {
	struct arena *arena;
	const struct ground *ground;
	const struct site_set *sites;
	const struct graph *bare; /* the network's, weighed with eta = 0 */
	void (*progress)(void *context, double share);
	void *context;
	int searches_done;
};

struct outcome {
	double length;
	double energy; /* weight units of `bare` */
};

static double mean_density(const struct field *field)
{
	double sum = 0;
	for (uint32_t f = 0; f < field->face_count; f++)
		sum += field->density[f];
	return field->face_count ? sum / field->face_count : 0;
}

static double tree_length(const struct network *network, const struct steiner_tree *tree)
{
	double length = 0;
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		struct laid_edge laid[2];
		network_lay(network, tree->edges[i], network->graph.ends[2 * (size_t)tree->edges[i]], laid);
		length += vec2_distance(laid[0].from, laid[0].to);
	}
	return length;
}

static void pass_progress(void *context, const struct steiner_progress *progress)
{
	const struct balance *balance = context;
	balance->progress(balance->context, (balance->searches_done + pricing_solved(progress)) / SEARCHES);
}

static enum tw_status try_eta(struct balance *balance, double eta, struct outcome *outcome, struct tw_error *error)
{
	struct arena_mark mark = arena_mark(balance->arena);
	struct pricing pricing;
	struct steiner_tree tree;
	enum tw_status status = pricing_build(&pricing, balance->arena, balance->ground, balance->sites, eta, error);
	const struct pricing_search search = {.graph = &pricing.network.graph,
					      .time_share = 1.0 / SEARCHES,
					      .progress = pass_progress,
					      .context = balance};
	if (!status)
		status = pricing_solve(&pricing, balance->arena, &balance->ground->input, &search, &tree, error);
	balance->searches_done++;
	balance->progress(balance->context, (double)balance->searches_done / SEARCHES);
	if (!status) {
		*outcome = (struct outcome){.length = tree_length(&pricing.network, &tree)};
		for (uint32_t i = 0; i < tree.edge_count; i++)
			outcome->energy += (double)balance->bare->weight[tree.edges[i]];
	}
	arena_release(balance->arena, mark);
	return status;
}

/* Three digits say enough, and look like a choice rather than noise. */
static double round_digits(double value)
{
	char text[32];
	snprintf(text, sizeof text, "%.3g", value);
	return strtod(text, NULL);
}

static enum tw_status halve(struct balance *balance, double low, double high, double *eta, struct tw_error *error)
{
	struct outcome at_low, at_high, here;
	enum tw_status status = try_eta(balance, low, &at_low, error);
	if (!status)
		status = try_eta(balance, high, &at_high, error);
	if (status)
		return status;
	double length_fall = at_low.length - at_high.length, energy_rise = at_high.energy - at_low.energy;
	/* Where eta changes nothing, the field's own is as good as any. */
	if (!(length_fall > 0) || !(energy_rise > 0))
		return TW_OK;
	double least = INFINITY;
	for (int i = 0; i < HALVINGS; i++) {
		double middle = round_digits(sqrt(low * high));
		status = try_eta(balance, middle, &here, error);
		if (status)
			return status;
		double longer = (here.length - at_high.length) / length_fall;
		double dearer = (here.energy - at_low.energy) / energy_rise;
		*(longer > dearer ? &low : &high) = middle;
		/* Steps may leap over the crossing: the most balanced one counts. */
		if (fabs(longer - dearer) < least) {
			least = fabs(longer - dearer);
			*eta = middle;
		}
	}
	return TW_OK;
}

enum tw_status pricing_balance(double *eta_mpa, struct arena *arena, const struct ground *ground,
			       const struct site_set *sites, void (*progress)(void *context, double share),
			       void *context, struct tw_error *error)
{
	const struct field *field = &ground->field;
	double mean = mean_density(field);
	*eta_mpa = field->options.eta_mpa;
	if (!(mean > 0) || field->options.weight != FIELD_DEFORMATION)
		return TW_OK;
	struct arena_mark mark = arena_mark(arena);
	struct pricing bare;
	enum tw_status status = pricing_build(&bare, arena, ground, sites, 0, error);
	if (!status) {
		struct balance balance = {arena, ground, sites, &bare.network.graph, progress, context, 0};
		status = halve(&balance, mean / extreme, mean * extreme, eta_mpa, error);
	}
	arena_release(arena, mark);
	return status;
}
