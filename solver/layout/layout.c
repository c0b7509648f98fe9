/* The stages of a layout, in their order: place the terminals, build the network, find the tree, smooth it, measure it;
 * the same for the baseline; then stream the motions once for both, and write the files. */
#include "solver/layout/layout.h"

#include "solver/layout/artifacts.h"
#include "solver/layout/pricing.h"
#include "solver/layout/result.h"

#include <string.h>
#include <time.h>

/* Work units for the baseline, some seconds' worth. It is there to compare with, and unit weights on a mesh have so
 * many ties that a proof can cost far more than our own tree's; beyond this its best tree does, and its bound is
 * reported. */
#define BASELINE_WORK 300000000u

/* What of the whole is done at the end of a stage, roughly; the balance of eta is only seldom asked for. */
#define SHARE_PLACED 0.02
#define SHARE_BALANCED 0.4
#define SHARE_SOLVED 0.6
#define SHARE_COMPARED 0.8

struct job {
	const struct layout_input *input; /* the ground's */
	struct arena *arena;
	struct ground ground;
	struct arena *scratch; /* of the strips */
	struct strip_cutter cutter;
	struct site_set sites;
	struct pricing pricing;
	struct wire_rules rules, baseline_rules; /* the baseline's tree is of mesh edges */
	struct solved ours, baseline;
	struct layout_trees trees; /* as they were found */
	struct layout_found found;
	struct layout_progress progress;
	double share_from, share_to; /* what the running search is of the whole */
};

static double now(void)
{
	struct timespec time;
	clock_gettime(CLOCK_MONOTONIC, &time);
	return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* The seconds since *start, which becomes now. */
static double lap(double *start)
{
	double end = now(), seconds = end - *start;
	*start = end;
	return seconds;
}

static void report(struct job *job, const char *stage, double share)
{
	job->progress.stage = stage;
	job->progress.share = share;
	if (job->input->progress)
		job->input->progress(job->input->context, &job->progress);
}

/* Begins a stage, unless the layout is not wanted any more. */
static enum tw_status enter(struct job *job, const char *stage, double share, struct tw_error *error)
{
	report(job, stage, share);
	if (job->input->cancelled && job->input->cancelled(job->input->context))
		return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the layout was cancelled");
	return TW_OK;
}

static void report_search(void *context, const struct steiner_progress *search)
{
	struct job *job = context;
	/* Of the baseline's search the outside sees the share alone. */
	if (!strcmp(job->progress.stage, "tree")) {
		job->progress.weight = search->weight;
		job->progress.lower_bound = search->lower_bound;
	}
	report(job, job->progress.stage, job->share_from + pricing_solved(search) * (job->share_to - job->share_from));
}

static void report_balance(void *context, double share)
{
	report(context, "eta", SHARE_PLACED + share * (SHARE_BALANCED - SHARE_PLACED));
}

/* A tree of mesh edges zigzags, and a curve is the better the farther it may leave it: by half a zigzag and more. With
 * chords it is nearly straight, and what is left for a curve is to be smooth. Measured over 24 random layouts of the
 * coarse suit, chords: energies 105375 at 35 mm, 103669 at 10, 103390 at 6, 103672 at 2. Half the strip width is the
 * smallest radius: with less, sharp bends have no room for it (the sample suit with 36 terminals, 5 / 7.5 / 15 mm:
 * energy 15948 / 15963 / 16229, broken rules 9 / 3 / 1). */
static double choose_tolerance(const struct job *job, bool has_chords)
{
	double asked = job->input->request->options.tolerance_mm;
	double width = job->pricing.field->options.strip_width_mm, edge = job->pricing.network.mean_edge_mm;
	if (!isnan(asked))
		return asked;
	return has_chords ? fmax(width / 2, 0.4 * edge) : fmax(width, 1.5 * edge);
}

static void choose_rules(struct job *job)
{
	const struct layout_options *options = &job->input->request->options;
	double half = job->pricing.field->options.strip_width_mm / 2;
	job->rules = (struct wire_rules){
		.strip_width_mm = 2 * half,
		.minimum_radius_mm = isnan(options->minimum_radius_mm) ? half : options->minimum_radius_mm,
		.tolerance_mm = choose_tolerance(job, job->pricing.has_chords),
		.clearance_mm = isnan(options->seam_clearance_mm) ? half : options->seam_clearance_mm,
		.spacing_mm = options->strip_spacing_mm,
		.face_keep_out = job->pricing.constraints ? job->pricing.constraints->face_keep_out : NULL,
		.keep_out = job->pricing.keep_out_walker,
	};
	job->baseline_rules = job->rules;
	job->baseline_rules.tolerance_mm = choose_tolerance(job, false);
}

static bool has_terminals_on_pattern(const struct layout_request *request)
{
	for (uint32_t i = 0; i < request->terminal_count; i++)
		if (request->terminals[i].kind == TERMINAL_PATTERN)
			return true;
	return false;
}

/* Terminals are given in the caller's numbers. */
static enum tw_status place_sites(struct job *job, struct tw_error *error)
{
	const struct layout_input *asked = job->ground.asked;
	const struct locator *locator = NULL;
	enum tw_status status = TW_OK;
	if (has_terminals_on_pattern(asked->request))
		status = locator_build(&locator, job->arena, asked->garment, error);
	if (status == TW_OK)
		status = terminals_place(&job->sites, job->arena, asked->garment, asked->topology, locator,
					 asked->request, asked->request->options.snap_mm, error);
	return status != TW_OK ? status : ground_take_sites(&job->ground, job->arena, &job->sites, error);
}

static enum tw_status choose_eta(struct job *job, struct tw_error *error)
{
	const struct layout_trees *given = job->input->trees;
	job->trees.eta_mpa = given ? given->eta_mpa : NAN;
	if (given || job->input->request->options.eta != ETA_AUTO)
		return TW_OK;
	report_balance(job, 0);
	return pricing_balance(&job->trees.eta_mpa, job->arena, &job->ground, &job->sites, report_balance, job, error);
}

static enum tw_status prepare(struct job *job, struct tw_error *error)
{
	const struct layout_input *input = job->input;
	enum tw_status status = ground_build(&job->ground, job->arena, job->ground.asked, error);
	if (status == TW_OK)
		status = strip_cutter_init(&job->cutter, job->arena, job->scratch, input->garment, input->topology,
					   &job->ground.base->outline, error);
	if (status == TW_OK)
		status = place_sites(job, error);
	if (status == TW_OK)
		status = choose_eta(job, error);
	if (status == TW_OK)
		status = pricing_build(&job->pricing, job->arena, &job->ground, &job->sites, job->trees.eta_mpa, error);
	if (status == TW_OK)
		choose_rules(job);
	return status;
}

/* A tree that was found before. */
static enum tw_status take_tree(const struct job *job, const struct graph *graph, const struct layout_tree *given,
				struct steiner_tree *tree, struct tw_error *error)
{
	const struct network *network = &job->pricing.network;
	*tree = (struct steiner_tree){
		.outcome = given->is_optimal ? STEINER_OPTIMAL : STEINER_LIMIT,
		.weight = given->weight,
		.lower_bound = given->lower_bound,
		.edges = ARENA_ARRAY(job->arena, given->edge_count, uint32_t),
		.edge_count = given->edge_count,
	};
	if (!tree->edges)
		return tw_fail_memory(error);
	if (given->edge_count)
		memcpy(tree->edges, given->edges, given->edge_count * sizeof *tree->edges);
	return steiner_verify(graph, network->terminal, network->sites->count, tree->edges, tree->edge_count,
			      tree->weight, error);
}

static struct layout_tree tree_of(const struct steiner_tree *tree)
{
	return (struct layout_tree){
		.is_optimal = tree->outcome == STEINER_OPTIMAL,
		.weight = tree->weight,
		.lower_bound = tree->lower_bound,
		.edges = tree->edges,
		.edge_count = tree->edge_count,
	};
}

static enum tw_status search(struct job *job, const struct pricing_search *search, const char *stage,
			     struct steiner_tree *tree, struct tw_error *error)
{
	enum tw_status status = enter(job, stage, job->share_from, error);
	return status != TW_OK ? status : pricing_solve(&job->pricing, job->arena, job->input, search, tree, error);
}

/* What a warm state is prepared with, as it must be: chords are cut later. */
static void keep_search(struct job *job, const struct pricing_search *search)
{
	const struct network *network = &job->pricing.network;
	job->found = (struct layout_found){
		.graph = *search->graph,
		.terminal = network->terminal,
		.terminal_count = network->sites->count,
		.options = pricing_options(&job->pricing, job->input, search),
		.tree = job->ours.tree,
	};
}

/* Our tree, searched or given. */
static enum tw_status find_tree(struct job *job, struct tw_error *error)
{
	const struct layout_trees *given = job->input->trees;
	const struct pricing_search ours = {
		.graph = job->pricing.graph,
		.time_share = 1,
		.warm = job->input->warm,
		.progress = report_search,
		.context = job,
	};
	enum tw_status status = given ? take_tree(job, ours.graph, &given->ours, &job->ours.tree, error)
				      : search(job, &ours, "tree", &job->ours.tree, error);
	if (status != TW_OK)
		return status;
	job->trees.ours = tree_of(&job->ours.tree);
	keep_search(job, &ours);
	return TW_OK;
}

/* The baseline's graph is the network's with other weights. */
static enum tw_status find_baseline(struct job *job, struct tw_error *error)
{
	const struct layout_trees *given = job->input->trees;
	struct steiner_tree *tree = &job->baseline.tree;
	struct graph graph = job->pricing.network.graph;
	uint64_t *weight = ARENA_ARRAY(job->arena, graph.edge_count, uint64_t);
	if (!weight)
		return tw_fail_memory(error);
	memcpy(weight, job->pricing.network.baseline, graph.edge_count * sizeof *weight);
	graph.weight = weight;
	const struct pricing_search length = {.graph = &graph,
					      .work_limit = BASELINE_WORK,
					      .time_share = 1,
					      .progress = report_search,
					      .context = job};
	enum tw_status status = given ? take_tree(job, &graph, &given->baseline, tree, error)
				      : search(job, &length, "baseline", tree, error);
	if (status == TW_OK)
		job->trees.baseline = tree_of(tree);
	return status;
}

/* What a millimetre along each edge costs; NULL where edges have no price of their own. */
static enum tw_status find_costs(const struct job *job, const double **costs, struct tw_error *error)
{
	const struct network *network = &job->pricing.network;
	*costs = NULL;
	if (job->pricing.field->options.weight != FIELD_DEFORMATION)
		return TW_OK;
	double *cost = ARENA_ARRAY(job->arena, network->graph.edge_count, double);
	if (!cost)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < network->graph.edge_count; e++) {
		struct laid_edge laid[2];
		network_lay(network, e, network->graph.ends[2 * (size_t)e], laid);
		double length = vec2_distance(laid[0].from, laid[0].to);
		double energy = (double)network->graph.weight[e] / job->pricing.field->scale;
		cost[e] = length > 1e-6 && energy > 0 ? energy / length : 1e-6;
	}
	*costs = cost;
	return TW_OK;
}

static struct metrics_input metrics_input_of(const struct job *job, const struct solved *solved)
{
	return (struct metrics_input){
		.garment = job->input->garment,
		.locator = job->ground.base->locator,
		.field = job->pricing.field,
		.branches = &solved->branches,
		.wires = &solved->wires,
		.fabric = &job->pricing.fabric,
		.walker = job->pricing.walker,
	};
}

static enum tw_status draw(struct job *job, struct solved *solved, const struct wire_rules *rules, const double *costs,
			   double *seconds_metrics, struct tw_error *error)
{
	enum tw_status status = branches_cut(&solved->branches, job->arena, &job->pricing.network, solved->tree.edges,
					     solved->tree.edge_count, 2 * rules->strip_width_mm, error);
	if (status == TW_OK)
		status = wires_smooth(&solved->wires, job->arena, &job->pricing.network, &solved->branches,
				      &job->ground.base->outline, job->ground.base->locator, rules, costs, error);
	if (status == TW_OK)
		status = strips_cut_all(&job->cutter, solved->wires.wire, solved->branches.branch_count,
					rules->strip_width_mm, &solved->strips, error);
	if (status != TW_OK)
		return status;
	const struct metrics_input input = metrics_input_of(job, solved);
	double start = now();
	const struct rules_input checked = {
		.network = &job->pricing.network,
		.locator = job->ground.base->locator,
		.branches = &solved->branches,
		.wires = &solved->wires,
		.strips = solved->strips,
		.cutter = &job->cutter,
		.rules = rules,
	};
	status = rules_check(&solved->violations, job->arena, &checked, error);
	if (status == TW_OK)
		status = metrics_measure(&solved->metrics, &solved->trace, job->arena, &input, error);
	*seconds_metrics += now() - start;
	return status;
}

/* From here on the tree's edges lie in a face each. */
static enum tw_status leave_chords(struct job *job, struct tw_error *error)
{
	struct pricing *pricing = &job->pricing;
	return chord_graph_cut(&pricing->chords, job->arena, &pricing->network, &job->ours.tree, &pricing->fabric,
			       error);
}

static enum tw_status solve(struct job *job, struct layout_summary *summary, struct tw_error *error)
{
	double start = now();
	bool compare = job->pricing.network.baseline != NULL;
	job->share_from = job->input->request->options.eta == ETA_AUTO ? SHARE_BALANCED : SHARE_PLACED;
	job->share_to = compare ? SHARE_SOLVED : SHARE_COMPARED;
	enum tw_status status = find_tree(job, error);
	summary->seconds_tree = lap(&start);
	if (status != TW_OK)
		return status;
	job->progress.weight = job->ours.tree.weight;
	job->progress.lower_bound = job->ours.tree.lower_bound;
	if (compare) {
		job->share_from = SHARE_SOLVED, job->share_to = SHARE_COMPARED;
		status = find_baseline(job, error);
		summary->seconds_baseline = lap(&start);
	}
	const double *costs = NULL;
	if (status == TW_OK)
		status = enter(job, "curves", SHARE_COMPARED, error);
	job->ours.has_chords = job->pricing.has_chords;
	if (status == TW_OK && job->ours.has_chords)
		status = leave_chords(job, error);
	if (status == TW_OK)
		status = find_costs(job, &costs, error);
	if (status == TW_OK)
		status = draw(job, &job->ours, &job->rules, costs, &summary->seconds_metrics, error);
	if (status == TW_OK && compare)
		status = draw(job, &job->baseline, &job->baseline_rules, NULL, &summary->seconds_metrics, error);
	summary->seconds_curves = lap(&start) - summary->seconds_metrics;
	return status;
}

/* Frames have the caller's vertices. */
static enum tw_status take_trace(struct trace *asked, const struct job *job, const struct trace *trace,
				 uint32_t branches, struct tw_error *error)
{
	const uint32_t places = trace->first[branches];
	*asked = *trace;
	asked->place = ARENA_ARRAY(job->arena, places, struct place);
	if (!asked->place)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < places; i++)
		asked->place[i] = ground_asked_place(&job->ground, &trace->place[i]);
	return TW_OK;
}

static enum tw_status stretch(struct job *job, struct tw_error *error)
{
	struct layout_metrics *metrics[2] = {&job->ours.metrics, &job->baseline.metrics};
	struct trace asked[2];
	const struct trace *trace[2] = {&asked[0], &asked[1]};
	const struct branch_set *branches[2] = {&job->ours.branches, &job->baseline.branches};
	const uint32_t layouts = job->pricing.network.baseline ? 2 : 1;
	enum tw_status status = take_trace(&asked[0], job, &job->ours.trace, job->ours.branches.branch_count, error);
	if (status == TW_OK && layouts == 2)
		status = take_trace(&asked[1], job, &job->baseline.trace, job->baseline.branches.branch_count, error);
	if (status != TW_OK)
		return status;
	return metrics_elongation(metrics, trace, branches, layouts, job->ground.asked, job->arena, error);
}

static enum tw_status split_by_motion(struct job *job, struct tw_error *error)
{
	struct layout_metrics *metrics[2] = {&job->ours.metrics, &job->baseline.metrics};
	const struct metrics_input inputs[2] = {metrics_input_of(job, &job->ours),
						metrics_input_of(job, &job->baseline)};
	const struct metrics_input *const both[2] = {&inputs[0], &inputs[1]};
	return metrics_energies(metrics, both, job->pricing.network.baseline ? 2 : 1, job->input,
				job->ground.base->canonical.face, job->arena, error);
}

/* What is asked of the motions, and what they can tell. */
static enum tw_status look_at_motions(struct job *job, bool *has_elongation, struct tw_error *error)
{
	const struct layout_input *input = job->input;
	*has_elongation = false;
	if (!input->request->options.elongation || input->motion_count == 0)
		return TW_OK;
	enum tw_status status = enter(job, "elongation", 0.85, error);
	for (uint32_t m = 0; m < input->motion_count; m++)
		*has_elongation |= layout_has_frames(input, m);
	if (status == TW_OK && *has_elongation)
		status = stretch(job, error);
	if (status == TW_OK && input->motion_mean)
		status = split_by_motion(job, error);
	return status;
}

static const struct layout_figures no_figures = {NAN, NAN, NAN, NAN, NAN};

static struct layout_figures figures_of(const struct branch_metrics *total, bool has_elongation)
{
	return (struct layout_figures){
		.energy = total->energy,
		.energy_without_eta = total->energy_without_eta,
		.length_mm = total->length_mm,
		.elongation_max = has_elongation ? total->elongation.max : NAN,
		.elongation_mean = has_elongation ? total->elongation.mean : NAN,
	};
}

/* What is no error, and yet hardly meant. */
static void find_warnings(const struct job *job, struct warning_list *warnings)
{
	const struct layout_request *request = job->input->request;
	for (uint32_t t = 0; t < request->terminal_count; t++) {
		uint32_t first = job->sites.site[job->sites.site_of[t]].terminal;
		if (first != t)
			warning_add(warnings, "terminals-doubled", "terminal", t,
				    "terminals at the place of another count as one with it");
	}
	if (job->sites.count == 1)
		warning_add_whole(warnings, "one-terminal",
				  "there is but one terminal, or all are at one place: nothing is to be wired");
	field_warn_of_no_motion(job->input->field, warnings);
}

static void summarise(const struct job *job, const struct layout_result *result, struct layout_summary *summary)
{
	bool has_elongation = result->has_elongation;
	summary->outcome = job->ours.tree.outcome;
	summary->terminal_count = job->sites.count;
	summary->weight = job->ours.tree.weight;
	summary->lower_bound = job->ours.tree.lower_bound;
	summary->energy_scale = field_energy_scale(job->input->field);
	summary->junction_count = job->ours.metrics.junction_count;
	summary->violation_count = job->ours.violations.count;
	summary->ours = figures_of(&job->ours.metrics.total, has_elongation);
	summary->baseline = result->baseline ? figures_of(&job->baseline.metrics.total, has_elongation) : no_figures;
	summary->steiner = job->ours.tree.stats;
	find_warnings(job, &summary->warnings);
	rules_warn(&job->ours.violations, job->input->garment, &summary->warnings);
	summary->has_baseline = result->baseline != NULL;
	if (!summary->has_baseline)
		return;
	summary->baseline_outcome = job->baseline.tree.outcome;
	summary->baseline_gap = layout_gap(job->baseline.tree.weight, job->baseline.tree.lower_bound);
}

static enum tw_status compute(struct job *job, struct layout_output *output, struct tw_error *error)
{
	const struct layout_input *input = job->input;
	struct layout_summary *summary = &output->summary;
	double begin = now(), start = begin;
	*output = (struct layout_output){0};
	report(job, "terminals", 0);
	enum tw_status status = prepare(job, error);
	summary->seconds_terminals = lap(&start);
	if (status == TW_OK)
		status = solve(job, summary, error);
	bool has_elongation = false;
	start = now();
	if (status == TW_OK)
		status = look_at_motions(job, &has_elongation, error);
	summary->seconds_elongation = lap(&start);
	if (status == TW_OK)
		status = enter(job, "artifacts", 0.97, error);
	if (status != TW_OK)
		return status;
	struct layout_result result = {
		.input = input,
		.ground = &job->ground,
		.field = job->pricing.field,
		.outline = &job->ground.base->outline,
		.locator = job->ground.base->locator,
		.sites = &job->sites,
		.network = &job->pricing.network,
		.rules = &job->rules,
		.baseline_rules = &job->baseline_rules,
		.ours = &job->ours,
		.baseline = job->pricing.network.baseline ? &job->baseline : NULL,
		.has_motions = input->request->options.elongation && input->motion_count > 0,
		.has_elongation = has_elongation,
		.summary = summary,
	};
	summarise(job, &result, summary);
	output->trees = job->trees;
	output->found = job->found;
	status = artifacts_write(&result, job->arena, output, error);
	summary->seconds_artifacts = lap(&start);
	summary->seconds_total = start - begin;
	return status;
}

enum tw_status layout_compute(const struct layout_input *input, struct arena *arena, struct layout_output *output,
			      struct tw_error *error)
{
	struct job job = {.input = &job.ground.input,
			  .arena = arena,
			  .scratch = arena_new(0),
			  .ground = {.asked = input, .input = *input},
			  .progress = {.weight = UINT64_MAX, .energy_scale = field_energy_scale(input->field)}};
	enum tw_status status = job.scratch ? compute(&job, output, error) : tw_fail_memory(error);
	arena_free(job.scratch);
	return status;
}
