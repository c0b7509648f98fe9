/* The figures of a layout for a table or a list: what stands in a job's summary, on the command line and, in full, in
 * layout.json. What they are called, and how they compare with the baseline, is said here and nowhere else. */
#ifndef SOLVER_LAYOUT_SUMMARY_H
#define SOLVER_LAYOUT_SUMMARY_H

#include "solver/steiner/steiner.h"
#include "solver/warning.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Of a whole layout; NAN where not computed. */
struct layout_figures {
	double energy, energy_without_eta; /* deformation energy of the curves, MPa·mm² */
	double length_mm;
	double elongation_max, elongation_mean; /* 0.12 is 12 % */
};

struct layout_summary {
	enum steiner_outcome outcome;
	uint32_t terminal_count;      /* after merging */
	uint64_t weight, lower_bound; /* of the tree, in weight units of the field */
	double energy_scale;          /* of these units: field_energy_scale */
	bool has_baseline;
	enum steiner_outcome baseline_outcome; /* of its search, which ends after a fixed amount of work */
	double baseline_gap;                   /* how far it may be from the best, as a share of its weight */
	uint32_t junction_count;
	uint32_t violation_count; /* of the design rules */
	struct layout_figures ours, baseline;
	struct warning_list warnings; /* of the terminals, the field and the design rules */
	struct steiner_stats steiner;
	double seconds_terminals, seconds_tree, seconds_baseline, seconds_curves, seconds_metrics, seconds_elongation,
		seconds_artifacts, seconds_total; /* wall clock; never in artifact bytes */
};

/* One figure: a row for each member of struct layout_figures. */
struct layout_figure {
	const char *name;  /* the member of a summary, "energy_mpa_mm2"; the baseline's has "baseline_" before it */
	const char *share; /* what its reduction is called, "energy" */
	const char *title; /* for people, "energy" */
	const char *unit;  /* for people, "MPa·mm²" */
	double unit_scale; /* what a value is multiplied with to be in that unit */
	size_t offset;     /* in struct layout_figures */
};
enum { LAYOUT_FIGURES = 5 };
extern const struct layout_figure layout_figures[LAYOUT_FIGURES];

double layout_figure_of(const struct layout_figure *figure, const struct layout_figures *figures);

/* How much less ours has than the baseline, in per cent of the baseline; NAN where one of them is not there or the
 * baseline has nothing. */
double layout_reduction_percent(double ours, double baseline);

/* "optimal", "limit". */
const char *layout_outcome_name(enum steiner_outcome outcome);

/* A weight in MPa mm2; `energy_scale` as field_energy_scale says, and NAN where that is. */
double layout_energy_of(uint64_t weight, double energy_scale);

/* Adds the weight to an object: `name` as a decimal string, since weights go up to 2^60 and a number of JSON holds
 * 2^53, and `name`_mpa_mm2 beside it, null where weights are no energies. False when out of memory. */
bool layout_weight_add(json_t *object, const char *name, uint64_t weight, double energy_scale);

/* Adds "weight", "lower_bound" (as layout_weight_add does) and "gap". False when out of memory. */
bool layout_bounds_add(json_t *object, uint64_t weight, uint64_t lower_bound, double energy_scale);

/* How far the tree may be from the best, as a share of its weight. */
double layout_gap(uint64_t weight, uint64_t lower_bound);

/* The summary as an object; `seconds` stand in a member of that name. A new reference, NULL when out of memory. */
json_t *layout_summary_show(const struct layout_summary *summary);

#endif
