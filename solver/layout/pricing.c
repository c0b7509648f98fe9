#include "solver/layout/pricing.h"

#include <math.h>

/* Baselines, and fields that are one, stay on the mesh's edges. */
static bool may_use_chords(const struct layout_input *input)
{
	const struct layout_options *options = &input->request->options;
	if (input->field->options.weight != FIELD_DEFORMATION)
		return false;
	if (options->relaxation != RELAXATION_AUTO)
		return options->relaxation == RELAXATION_CHORDS;
	return options->preset == LAYOUT_PRESET_FIELD ? input->field->options.preset != FIELD_PRESET_PAPER
						      : options->preset != LAYOUT_PRESET_PAPER;
}

/* To a field that was stored without. */
static enum tw_status add_chords(struct pricing *pricing, struct arena *arena, const struct layout_input *input,
				 struct tw_error *error)
{
	pricing->own = *input->field;
	pricing->field = &pricing->own;
	return field_weigh_chords(&pricing->own, arena, input->garment, input->topology, NULL,
				  input->threads ? input->threads : 1, NULL, error);
}

static enum tw_status find_field(struct pricing *pricing, struct arena *arena, const struct ground *ground,
				 double eta_mpa, struct tw_error *error)
{
	const struct layout_input *input = &ground->input;
	pricing->field = input->field;
	pricing->constraints = ground->constraints;
	pricing->has_chords = may_use_chords(input);
	if (!pricing->constraints && isnan(eta_mpa))
		return pricing->has_chords && !input->field->chord_weight ? add_chords(pricing, arena, input, error)
									  : TW_OK;
	struct field_options options = input->field->options;
	options.eta_mpa = isnan(eta_mpa) ? options.eta_mpa : eta_mpa;
	pricing->field = &pricing->own;
	const unsigned threads = input->threads ? input->threads : 1;
	enum tw_status status = field_weigh(&pricing->own, arena, input->garment, input->topology,
					    input->field->density, &options, pricing->constraints, threads, error);
	if (status == TW_OK && pricing->has_chords)
		status = field_weigh_chords(&pricing->own, arena, input->garment, input->topology, pricing->constraints,
					    threads, NULL, error);
	return status;
}

static enum tw_status make_walker(struct strip_walker **walker, struct strip_fabric *fabric, struct arena *arena,
				  const struct layout_input *input, const struct field *field,
				  const struct field_constraints *constraints, struct tw_error *error)
{
	double *value = ARENA_ARRAY(arena, input->garment->face_count, double);
	if (!value)
		return tw_fail_memory(error);
	field_value(field, constraints, value);
	enum tw_status status = strip_fabric_build(fabric, arena, input->garment, input->topology, value, error);
	return status != TW_OK ? status : strip_walker_new(walker, arena, fabric, error);
}

static enum tw_status make_keep_out_walker(struct pricing *pricing, struct arena *arena,
					   const struct layout_input *input, struct tw_error *error)
{
	const uint8_t *keep_out = pricing->constraints ? pricing->constraints->face_keep_out : NULL;
	pricing->keep_out_walker = NULL;
	if (!keep_out)
		return TW_OK;
	double *value = ARENA_ARRAY(arena, input->garment->face_count, double);
	if (!value)
		return tw_fail_memory(error);
	for (uint32_t f = 0; f < input->garment->face_count; f++)
		value[f] = keep_out[f] ? 1 : 0;
	enum tw_status status =
		strip_fabric_build(&pricing->keep_out_fabric, arena, input->garment, input->topology, value, error);
	if (status == TW_OK)
		status = strip_walker_new(&pricing->keep_out_walker, arena, &pricing->keep_out_fabric, error);
	return status;
}

enum tw_status pricing_build(struct pricing *pricing, struct arena *arena, const struct ground *ground,
			     const struct site_set *sites, double eta_mpa, struct tw_error *error)
{
	const struct layout_input *input = &ground->input;
	enum tw_status status = find_field(pricing, arena, ground, eta_mpa, error);
	if (status == TW_OK)
		status = make_walker(&pricing->walker, &pricing->fabric, arena, input, pricing->field, NULL, error);
	struct strip_walker *priced = pricing->walker;
	struct strip_fabric fabric;
	if (status == TW_OK && pricing->constraints)
		status = make_walker(&priced, &fabric, arena, input, pricing->field, pricing->constraints, error);
	if (status == TW_OK)
		status = make_keep_out_walker(pricing, arena, input, error);
	if (status != TW_OK)
		return status;
	const struct network_walkers walkers = {priced, pricing->keep_out_walker};
	status = network_build(&pricing->network, arena, ground->base, pricing->field, sites, &walkers,
			       (enum layout_baseline)input->request->options.baseline, error);
	pricing->graph = &pricing->network.graph;
	if (status != TW_OK || !pricing->has_chords)
		return status;
	pricing->graph = &pricing->chords.graph;
	return chord_graph_build(&pricing->chords, arena, &pricing->network, ground->base, pricing->field, error);
}

static enum tw_status fail_apart(const struct pricing *pricing, const struct steiner_tree *tree, struct tw_error *error)
{
	const struct network *network = &pricing->network;
	uint32_t terminal[2] = {0, 0};
	for (uint32_t s = 0; s < network->sites->count; s++) {
		if (network->terminal[s] == tree->terminal_a)
			terminal[0] = network->sites->site[s].terminal;
		if (network->terminal[s] == tree->terminal_b)
			terminal[1] = network->sites->site[s].terminal;
	}
	char where[64];
	for (int i = 0; i < 2; i++) {
		uint32_t node = i ? tree->terminal_b : tree->terminal_a;
		if (network->graph.first[node] != network->graph.first[node + 1])
			continue;
		snprintf(where, sizeof where, "/terminals/%u", terminal[i]);
		return tw_fail(
			error, TW_ERROR_INPUT, "terminals-apart", where,
			"no wire can leave this terminal: whichever way it went, its strip would cover what is kept "
			"out; move the terminal, or the keep-out half a strip away from it");
	}
	snprintf(where, sizeof where, "/terminals/%u", terminal[1]);
	return tw_fail(error, TW_ERROR_INPUT, "terminals-apart", where,
		       "no wire can join this terminal with terminal %u: what is kept out leaves no way between them",
		       terminal[0]);
}

/* The solver hands one context to its two callbacks; the search's progress and the request's cancelling have their own.
 */
struct callbacks {
	const struct layout_input *input;
	const struct pricing_search *search;
};

static void pass_progress(void *context, const struct steiner_progress *progress)
{
	const struct callbacks *callbacks = context;
	if (callbacks->search->progress)
		callbacks->search->progress(callbacks->search->context, progress);
}

static bool pass_cancelled(void *context)
{
	const struct callbacks *callbacks = context;
	return callbacks->input->cancelled && callbacks->input->cancelled(callbacks->input->context);
}

struct steiner_options pricing_options(const struct pricing *pricing, const struct layout_input *input,
				       const struct pricing_search *search)
{
	const struct network *network = &pricing->network;
	return (struct steiner_options){
		.ties = pricing->has_chords ? pricing->chords.tie : network->tie,
		.warm = search->warm,
		.lasting_count = network->garment->vertex_count,
		.vertex_name = network->node_hash + network->garment->vertex_count,
		.time_limit_s = input->request->options.time_limit_s * search->time_share,
		.work_limit = search->work_limit,
		.memory_limit = input->memory_limit,
		.threads = input->threads,
	};
}

enum tw_status pricing_solve(const struct pricing *pricing, struct arena *arena, const struct layout_input *input,
			     const struct pricing_search *search, struct steiner_tree *tree, struct tw_error *error)
{
	struct callbacks callbacks = {input, search};
	struct steiner_options options = pricing_options(pricing, input, search);
	options.progress = pass_progress;
	options.cancelled = pass_cancelled;
	options.context = &callbacks;
	enum tw_status status = steiner_solve(search->graph, pricing->network.terminal, pricing->network.sites->count,
					      &options, arena, tree, error);
	if (status != TW_OK)
		return status;
	if (tree->outcome == STEINER_CANCELLED)
		return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the layout was cancelled");
	return tree->outcome == STEINER_INFEASIBLE ? fail_apart(pricing, tree, error) : TW_OK;
}

double pricing_solved(const struct steiner_progress *progress)
{
	if (progress->weight == UINT64_MAX)
		return 0;
	return progress->weight ? (double)progress->lower_bound / (double)progress->weight : 1;
}
