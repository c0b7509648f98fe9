#include "solver/layout/summary.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <string.h>

#define FIGURE(member) offsetof(struct layout_figures, member)

const struct layout_figure layout_figures[LAYOUT_FIGURES] = {
	{"energy_mpa_mm2", "energy", "energy", "MPa·mm²", 1, FIGURE(energy)},
	{"energy_without_eta_mpa_mm2", "energy_without_eta", "energy without eta", "MPa·mm²", 1,
	 FIGURE(energy_without_eta)},
	{"length_mm", "length", "length", "mm", 1, FIGURE(length_mm)},
	{"elongation_max", "elongation_max", "elongation, max", "%", 100, FIGURE(elongation_max)},
	{"elongation_mean", "elongation_mean", "elongation, mean", "%", 100, FIGURE(elongation_mean)},
};

static_assert(sizeof(struct layout_figures) == LAYOUT_FIGURES * sizeof(double), "a row for each figure");

double layout_figure_of(const struct layout_figure *figure, const struct layout_figures *figures)
{
	double value;
	memcpy(&value, (const char *)figures + figure->offset, sizeof value);
	return value;
}

double layout_reduction_percent(double ours, double baseline)
{
	return baseline > 0 ? 100 * (1 - ours / baseline) : NAN;
}

const char *layout_outcome_name(enum steiner_outcome outcome)
{
	static const char *const names[] = {
		[STEINER_OPTIMAL] = "optimal",
		[STEINER_LIMIT] = "limit",
		[STEINER_CANCELLED] = "cancelled",
		[STEINER_INFEASIBLE] = "infeasible",
	};
	return names[outcome];
}

double layout_gap(uint64_t weight, uint64_t lower_bound)
{
	return weight > 0 ? (double)(weight - lower_bound) / (double)weight : 0;
}

/* null stands for what was not computed. */
static json_t *show_number(double value)
{
	return isfinite(value) ? json_real(value) : json_null();
}

double layout_energy_of(uint64_t weight, double energy_scale)
{
	return (double)weight / energy_scale;
}

bool layout_weight_add(json_t *object, const char *name, uint64_t weight, double energy_scale)
{
	char digits[24], beside[64];
	snprintf(digits, sizeof digits, "%" PRIu64, weight);
	snprintf(beside, sizeof beside, "%s_mpa_mm2", name);
	return !json_object_set_new(object, name, json_string(digits)) &&
	       !json_object_set_new(object, beside, show_number(layout_energy_of(weight, energy_scale)));
}

bool layout_bounds_add(json_t *object, uint64_t weight, uint64_t lower_bound, double energy_scale)
{
	return layout_weight_add(object, "weight", weight, energy_scale) &&
	       layout_weight_add(object, "lower_bound", lower_bound, energy_scale) &&
	       !json_object_set_new(object, "gap", json_real(layout_gap(weight, lower_bound)));
}

static json_t *show_seconds(const struct layout_summary *summary)
{
	return json_pack("{s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f}", "terminals", summary->seconds_terminals, "tree",
			 summary->seconds_tree, "baseline", summary->seconds_baseline, "curves",
			 summary->seconds_curves, "metrics", summary->seconds_metrics, "elongation",
			 summary->seconds_elongation, "artifacts", summary->seconds_artifacts, "total",
			 summary->seconds_total);
}

static bool add_figure(json_t *json, const struct layout_figure *figure, const struct layout_summary *summary)
{
	char name[64];
	snprintf(name, sizeof name, "baseline_%s", figure->name);
	return !json_object_set_new(json, figure->name, show_number(layout_figure_of(figure, &summary->ours))) &&
	       !json_object_set_new(json, name, show_number(layout_figure_of(figure, &summary->baseline)));
}

/* Savings over a baseline that is not proven may be larger than those over the true one. */
static bool add_baseline(json_t *json, const struct layout_summary *summary)
{
	bool has = summary->has_baseline;
	json_t *outcome = has ? json_string(layout_outcome_name(summary->baseline_outcome)) : json_null();
	return !json_object_set_new(json, "baseline_outcome", outcome) &&
	       !json_object_set_new(json, "baseline_gap", has ? json_real(summary->baseline_gap) : json_null());
}

json_t *layout_summary_show(const struct layout_summary *summary)
{
	json_t *json = json_pack("{s:s, s:I, s:I, s:I}", "outcome", layout_outcome_name(summary->outcome), "terminals",
				 (json_int_t)summary->terminal_count, "junctions", (json_int_t)summary->junction_count,
				 "violations", (json_int_t)summary->violation_count);
	bool complete = json && layout_bounds_add(json, summary->weight, summary->lower_bound, summary->energy_scale);
	complete = complete && add_baseline(json, summary);
	for (size_t i = 0; complete && i < LAYOUT_FIGURES; i++)
		complete = add_figure(json, &layout_figures[i], summary);
	complete = complete && !json_object_set_new(json, "warnings", warning_list_show(&summary->warnings)) &&
		   !json_object_set_new(json, "seconds", show_seconds(summary));
	if (complete)
		return json;
	json_decref(json);
	return NULL;
}
