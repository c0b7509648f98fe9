/* layout.json. Lengths are millimetres with 0.1 µm, energies MPa·mm²; weights are decimal strings, because they have up
 * to 60 bits, which many JSON readers round. Short lists stand on one line. */
#include "solver/garment/correspondence.h"
#include "solver/layout/result.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MM_DECIMALS = 4, ENERGY_DECIMALS = 6, SHARE_DECIMALS = 8 };

static void add_point(struct text *text, struct vec2 point)
{
	text_add(text, "[");
	text_number(text, point.x, MM_DECIMALS);
	text_add(text, ",");
	text_number(text, point.y, MM_DECIMALS);
	text_add(text, "]");
}

static void add_point3(struct text *text, const double point[3])
{
	for (int i = 0; i < 3; i++) {
		text_add(text, i ? "," : "[");
		text_number(text, point[i], MM_DECIMALS);
	}
	text_add(text, "]");
}

/* "key":value, with a comma before it. */
static void add_number(struct text *text, const char *key, double value, int decimals)
{
	text_format(text, ",\"%s\":", key);
	text_number(text, value, decimals);
}

static void add_options(struct text *text, const struct option_table *table, const void *values)
{
	json_t *object = option_to_json(table, values);
	/* 12 digits name every option as it was given and drop the noise of binary fractions. */
	char *dump = object ? json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(12)) : NULL;
	if (dump)
		text_add(text, dump);
	else
		text->failed = true;
	free(dump);
	json_decref(object);
}

const char *terminal_name(const struct layout_request *request, uint32_t terminal, char *buffer)
{
	if (request->terminals[terminal].name)
		return request->terminals[terminal].name;
	snprintf(buffer, 16, "T%u", terminal + 1);
	return buffer;
}

static void add_weights(struct text *text, const char *key, const double weights[3])
{
	text_format(text, ",\"%s\":", key);
	for (int k = 0; k < 3; k++) {
		text_add(text, k ? "," : "[");
		text_number(text, weights[k], SHARE_DECIMALS);
	}
	text_add(text, "]");
}

/* In the file's numbers, as a request gives it, and in the mesh's. */
static void add_indices(const struct layout_result *result, uint32_t terminal, const struct site *site,
			struct text *text)
{
	const struct garment *garment = result->ground->asked->garment;
	const struct layout_terminal *asked = &result->input->request->terminals[terminal];
	const struct place place = ground_asked_place(result->ground, &site->place);
	double weights[3];
	uint32_t face = 0;
	if (site->kind == SITE_VERTEX) {
		uint32_t mesh_vertex = result->ground->base->canonical.vertex[site->vertex];
		uint32_t vertex =
			asked->kind == TERMINAL_VERTEX ? asked->vertex : garment_file_vertex(garment, mesh_vertex);
		if (vertex != GARMENT_NONE)
			text_format(text, ",\"vertex\":%u", vertex);
		text_format(text, ",\"mesh_vertex\":%u", mesh_vertex);
	}
	bool triangle = garment_place_to_file(garment, place.face, place.barycentric, &face, weights);
	text_format(text, ",\"face\":%u", face);
	if (triangle)
		add_weights(text, "barycentric", weights);
	text_format(text, ",\"mesh_face\":%u", place.face);
	add_weights(text, "mesh_barycentric", place.barycentric);
}

static void add_marks(const struct garment *garment, const struct site *site, struct text *text)
{
	text_add(text, ",\"on_pattern\":[");
	for (uint32_t i = 0; i < site->mark_count; i++) {
		text_add(text, i ? ",{\"piece\":" : "{\"piece\":");
		text_json(text, garment->piece_name[site->mark[i].piece]);
		text_add(text, ",\"uv_mm\":");
		add_point(text, site->mark[i].at);
		text_add(text, "}");
	}
	text_add(text, "]");
}

static void add_site(const struct layout_result *result, uint32_t terminal, struct text *text)
{
	const struct garment *garment = result->input->garment;
	const struct site *site = &result->sites->site[result->sites->site_of[terminal]];
	char buffer[16];
	double point[3];
	place_on_worn(garment, &site->place, point);
	text_add(text, "\n    {\"name\":");
	text_json(text, terminal_name(result->input->request, terminal, buffer));
	add_indices(result, terminal, site, text);
	text_add(text, ",\"piece\":");
	text_json(text, garment->piece_name[garment->face_piece[site->place.face]]);
	text_add(text, ",\"uv_mm\":");
	add_point(text, place_on_pattern(garment, &site->place));
	add_marks(garment, site, text);
	text_add(text, ",\"point_mm\":");
	add_point3(text, point);
	if (result->sites->snapped_mm[terminal] >= 1e-4) /* less is a matter of rounding */
		add_number(text, "snapped_mm", result->sites->snapped_mm[terminal], MM_DECIMALS);
	if (site->terminal != terminal)
		text_format(text, ",\"merged_with\":%u", site->terminal);
	text_add(text, "}");
}

static void add_terminals(const struct layout_result *result, struct text *text)
{
	text_add(text, ",\n  \"terminals\":[");
	for (uint32_t i = 0; i < result->input->request->terminal_count; i++) {
		text_add(text, i ? "," : "");
		add_site(result, i, text);
	}
	text_add(text, "\n  ]");
}

static void add_elongation(struct text *text, const struct elongation *elongation)
{
	text_add(text, "{\"max\":");
	text_number(text, elongation->max, SHARE_DECIMALS);
	add_number(text, "mean", elongation->mean, SHARE_DECIMALS);
	text_add(text, "}");
}

static void add_branch_figures(const struct layout_result *result, const struct branch_metrics *figures,
			       struct text *text)
{
	text_add(text, "\"length_mm\":");
	text_number(text, figures->length_mm, MM_DECIMALS);
	add_number(text, "energy_mpa_mm2", figures->energy, ENERGY_DECIMALS);
	add_number(text, "energy_without_eta_mpa_mm2", figures->energy_without_eta, ENERGY_DECIMALS);
	add_number(text, "minimum_radius_mm", figures->minimum_radius_mm, MM_DECIMALS);
	add_number(text, "coverage", figures->coverage, 6);
	if (!result->has_elongation)
		return;
	text_add(text, ",\"elongation\":");
	add_elongation(text, &figures->elongation);
	text_add(text, ",\"elongation_by_motion\":[");
	for (uint32_t m = 0; m < result->input->motion_count; m++) {
		text_add(text, m ? "," : "");
		if (layout_has_frames(result->input, m))
			add_elongation(text, &figures->by_motion[m]);
		else
			text_add(text, "null");
	}
	text_add(text, "]");
}

static void add_energies(const struct layout_result *result, const struct motion_energy *by_motion, struct text *text)
{
	if (!by_motion)
		return;
	text_add(text, ",\"energy_by_motion\":[");
	for (uint32_t m = 0; m < result->input->motion_count; m++) {
		text_format(text, "%s{\"energy_mpa_mm2\":", m ? "," : "");
		text_number(text, by_motion[m].energy, ENERGY_DECIMALS);
		add_number(text, "energy_without_eta_mpa_mm2", by_motion[m].without_eta, ENERGY_DECIMALS);
		text_add(text, "}");
	}
	text_add(text, "]");
}

static void add_span(const struct layout_result *result, const struct span *span, struct text *text)
{
	text_add(text, "\n        {\"piece\":");
	text_json(text, result->input->garment->piece_name[span->piece]);
	text_format(text, ",\"type\":\"%s\",\"from_mm\":", span_is_arc(span) ? "arc" : "line");
	add_point(text, span->from);
	text_add(text, ",\"to_mm\":");
	add_point(text, span->to);
	if (span_is_arc(span)) {
		text_add(text, ",\"centre_mm\":");
		add_point(text, span->centre);
		add_number(text, "radius_mm", span->radius, MM_DECIMALS);
		add_number(text, "turn_rad", span->turn, SHARE_DECIMALS);
	}
	text_add(text, "}");
}

static void add_branch_end(const struct solved *solved, uint32_t end, const struct layout_result *result,
			   struct text *text)
{
	uint32_t site = solved->branches.end[end].site;
	if (site == GARMENT_NONE)
		text_format(text, "{\"junction\":%u}", end - result->sites->count);
	else
		text_format(text, "{\"terminal\":%u}", result->sites->site[site].terminal);
}

/* A terminal inside a face, or where a chord crosses an edge. */
static void add_inner_node(const struct layout_result *result, const struct site *site, bool in_file, struct text *text)
{
	const struct garment *garment = result->ground->asked->garment;
	struct place place = ground_asked_place(result->ground, &site->place);
	uint32_t face = place.face;
	double weights[3];
	if (site->terminal != GARMENT_NONE) {
		text_format(text, "{\"terminal\":%u}", site->terminal);
		return;
	}
	memcpy(weights, place.barycentric, sizeof weights);
	if (in_file && !garment_place_to_file(garment, place.face, place.barycentric, &face, weights)) {
		text_add(text, "null");
		return;
	}
	text_format(text, "{\"face\":%u", face);
	add_weights(text, "barycentric", weights);
	text_add(text, "}");
}

/* The tree's path from node to node, in the file's numbers or the mesh's. */
static void add_path(const struct layout_result *result, const struct branch *branch, const char *key, bool in_file,
		     struct text *text)
{
	const struct garment *garment = result->ground->asked->garment;
	text_format(text, ",\n       \"%s\":[", key);
	for (uint32_t i = 0; i <= branch->edge_count; i++) {
		uint32_t node = branch->node[i];
		text_add(text, i ? "," : "");
		if (node >= garment->vertex_count) {
			add_inner_node(result, network_site(result->network, node), in_file, text);
			continue;
		}
		uint32_t mesh_vertex = result->ground->base->canonical.vertex[node];
		uint32_t vertex = in_file ? garment_file_vertex(garment, mesh_vertex) : mesh_vertex;
		if (vertex == GARMENT_NONE)
			text_add(text, "null");
		else
			text_format(text, "%u", vertex);
	}
	text_add(text, "]");
}

static void add_branch(const struct layout_result *result, const struct solved *solved, uint32_t index,
		       struct text *text)
{
	const struct branch *branch = &solved->branches.branch[index];
	const struct wire *wire = &solved->wires.wire[index];
	text_add(text, "\n      {\"from\":");
	add_branch_end(solved, branch->end[0], result, text);
	text_add(text, ",\"to\":");
	add_branch_end(solved, branch->end[1], result, text);
	text_add(text, ",");
	add_branch_figures(result, &solved->metrics.branch[index], text);
	add_path(result, branch, "tree_vertices", true, text);
	add_path(result, branch, "tree_mesh_vertices", false, text);
	text_add(text, ",\n       \"spans\":[");
	for (uint32_t s = 0; s < wire->span_count; s++) {
		text_add(text, s ? "," : "");
		add_span(result, &wire->span[s], text);
	}
	text_add(text, "]}");
}

static void add_junctions(const struct layout_result *result, const struct solved *solved, struct text *text)
{
	text_add(text, ",\n    \"junctions\":[");
	for (uint32_t e = result->sites->count; e < solved->branches.end_count; e++) {
		const struct wire_end *end = &solved->wires.end[e];
		struct place place;
		double point[3];
		locator_find(result->locator, end->piece, end->at, &place);
		place_on_worn(result->input->garment, &place, point);
		text_format(text, "%s\n      {\"piece\":", e > result->sites->count ? "," : "");
		text_json(text, result->input->garment->piece_name[end->piece]);
		text_add(text, ",\"uv_mm\":");
		add_point(text, end->at);
		text_add(text, ",\"point_mm\":");
		add_point3(text, point);
		text_format(text, ",\"branches\":%u}", solved->branches.end[e].degree);
	}
	text_add(text, "]");
}

static void add_violations(const struct layout_result *result, const struct solved *solved, struct text *text)
{
	text_add(text, ",\n    \"violations\":[");
	for (uint32_t i = 0; i < solved->violations.count; i++) {
		const struct violation *violation = &solved->violations.violation[i];
		text_format(text, "%s\n      {\"rule\":\"%s\",\"branch\":%u", i ? "," : "", rule_name(violation->rule),
			    violation->branch);
		if (violation->other != GARMENT_NONE)
			text_format(text, ",\"other_branch\":%u", violation->other);
		text_add(text, ",\"piece\":");
		text_json(text, result->input->garment->piece_name[violation->piece]);
		text_add(text, ",\"at_mm\":");
		add_point(text, violation->at);
		text_format(text, ",\"unit\":\"%s\"", rule_unit(violation->rule));
		add_number(text, "value", violation->value, MM_DECIMALS);
		add_number(text, "limit", violation->limit, MM_DECIMALS);
		text_add(text, "}");
	}
	text_add(text, "]");
}

/* `energy_scale` as field_energy_scale says: NAN, and so null, for a baseline. */
static void add_tree(const struct solved *solved, double scale, double energy_scale, struct text *text)
{
	const struct steiner_tree *tree = &solved->tree;
	text_format(text, "\"outcome\":\"%s\",\"weight\":\"%llu\"", layout_outcome_name(tree->outcome),
		    (unsigned long long)tree->weight);
	add_number(text, "weight_mpa_mm2", layout_energy_of(tree->weight, energy_scale), ENERGY_DECIMALS);
	text_format(text, ",\"lower_bound\":\"%llu\"", (unsigned long long)tree->lower_bound);
	add_number(text, "lower_bound_mpa_mm2", layout_energy_of(tree->lower_bound, energy_scale), ENERGY_DECIMALS);
	add_number(text, "gap", layout_gap(tree->weight, tree->lower_bound), 9);
	add_number(text, "weight_scale", scale, 0);
	text_format(text, ",\"graph\":\"%s\",\"unique\":%s,\"reproducible\":%s", solved->has_chords ? "chords" : "mesh",
		    tree->is_unique ? "true" : "false", tree->is_reproducible ? "true" : "false");
}

static void add_solved(const struct layout_result *result, const struct solved *solved, double scale,
		       double energy_scale, struct text *text)
{
	const struct layout_metrics *metrics = &solved->metrics;
	text_add(text, "{\n    ");
	add_tree(solved, scale, energy_scale, text);
	text_add(text, ",\n    \"metrics\":{");
	add_branch_figures(result, &metrics->total, text);
	add_energies(result, metrics->energy_by_motion, text);
	text_format(text, ",\"branches\":%u,\"junctions\":%u,\"seam_crossings\":%u,\"violations\":%u}",
		    solved->branches.branch_count, metrics->junction_count, metrics->seam_crossings,
		    solved->violations.count);
	add_junctions(result, solved, text);
	text_add(text, ",\n    \"branches\":[");
	for (uint32_t b = 0; b < solved->branches.branch_count; b++) {
		text_add(text, b ? "," : "");
		add_branch(result, solved, b, text);
	}
	text_add(text, "]");
	add_violations(result, solved, text);
	text_add(text, "\n  }");
}

/* Of the figures that were computed. */
static void add_reductions(const struct layout_figures *ours, const struct layout_figures *baseline, struct text *text)
{
	bool first = true;
	text_add(text, "{");
	for (size_t i = 0; i < LAYOUT_FIGURES; i++) {
		const struct layout_figure *figure = &layout_figures[i];
		double value = layout_figure_of(figure, ours);
		if (!isfinite(value))
			continue;
		text_format(text, "%s\"%s\":", first ? "" : ",", figure->share);
		text_number(text, layout_reduction_percent(value, layout_figure_of(figure, baseline)), 4);
		first = false;
	}
	text_add(text, "}");
}

/* Of a layout in one motion; its length is the same in all. */
static struct layout_figures figures_in(const struct layout_metrics *metrics, uint32_t motion)
{
	const struct elongation *elongation = metrics->total.by_motion;
	const struct motion_energy *energy = metrics->energy_by_motion;
	return (struct layout_figures){
		.energy = energy ? energy[motion].energy : NAN,
		.energy_without_eta = energy ? energy[motion].without_eta : NAN,
		.length_mm = NAN,
		.elongation_max = elongation ? elongation[motion].max : NAN,
		.elongation_mean = elongation ? elongation[motion].mean : NAN,
	};
}

static void add_reductions_by_motion(const struct layout_result *result, struct text *text)
{
	if (!result->has_motions)
		return;
	text_add(text, ",\n  \"reduction_percent_by_motion\":[");
	for (uint32_t m = 0; m < result->input->motion_count; m++) {
		struct layout_figures ours = figures_in(&result->ours->metrics, m);
		struct layout_figures baseline = figures_in(&result->baseline->metrics, m);
		text_add(text, m ? "," : "");
		add_reductions(&ours, &baseline, text);
	}
	text_add(text, "]");
}

static void add_baseline(const struct layout_result *result, struct text *text)
{
	text_add(text, ",\n  \"baseline\":");
	add_solved(result, result->baseline, result->network->baseline_scale, NAN, text);
	text_add(text, ",\n  \"reduction_percent\":");
	add_reductions(&result->summary->ours, &result->summary->baseline, text);
	add_reductions_by_motion(result, text);
}

static void add_warnings(const struct layout_result *result, struct text *text)
{
	json_t *list = warning_list_show(&result->summary->warnings);
	char *dump = list ? json_dumps(list, JSON_COMPACT) : NULL;
	text_add(text, ",\n  \"warnings\":");
	if (dump)
		text_add(text, dump);
	else
		text->failed = true;
	free(dump);
	json_decref(list);
}

void write_layout_json(const struct layout_result *result, struct text *text)
{
	const struct layout_input *input = result->input;
	const struct garment *garment = result->ground->asked->garment;
	text_add(text, "{\n  \"format\":\"tightwire-layout\",\"version\":2,\n  \"options\":");
	add_options(text, &layout_option_table, &input->request->options);
	text_add(text, ",\n  \"field\":");
	add_options(text, &field_option_table, &result->field->options);
	text_format(text,
		    ",\n  \"garment\":{\"vertices\":%u,\"faces\":%u,\"file_vertices\":%u,\"file_faces\":%u,"
		    "\"pieces\":%u}",
		    garment->vertex_count, garment->face_count, garment_source_count(garment),
		    garment_file_faces(garment), garment->piece_count);
	text_add(text, ",\n  \"rules\":{\"minimum_radius_mm\":");
	text_number(text, result->rules->minimum_radius_mm, MM_DECIMALS);
	add_number(text, "tolerance_mm", result->rules->tolerance_mm, MM_DECIMALS);
	if (result->baseline)
		add_number(text, "baseline_tolerance_mm", result->baseline_rules->tolerance_mm, MM_DECIMALS);
	add_number(text, "seam_clearance_mm", result->rules->clearance_mm, MM_DECIMALS);
	add_number(text, "strip_spacing_mm", result->rules->spacing_mm, MM_DECIMALS);
	text_add(text, "},\n  \"motions\":[");
	for (uint32_t m = 0; result->has_motions && m < input->motion_count; m++) {
		text_add(text, m ? "," : "");
		text_json(text, input->motion_name[m]);
	}
	text_add(text, "]");
	if (result->has_elongation)
		text_format(text, ",\n  \"elongation_over\":\"%s\"",
			    field_reference_name(metrics_elongation_over(input)));
	add_terminals(result, text);
	add_warnings(result, text);
	text_add(text, ",\n  \"layout\":");
	add_solved(result, result->ours, result->field->scale, field_energy_scale(result->field), text);
	if (result->baseline)
		add_baseline(result, text);
	text_add(text, "\n}\n");
}
