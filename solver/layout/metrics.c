/* Every span is cut into pieces that a quadrilateral strip fits: a line as a whole, an arc into parts that turn by no
 * more than `arc_step`, with trapezoids inscribed. The same parts, cut again at the mesh's edges, give the trace. */
#include "solver/layout/metrics.h"

#include <stdbool.h>
#include <string.h>

static const double arc_step = 0.0873;     /* radians: 5 degrees; the chord of a 7.5 mm arc is off by 7 µm */
static const double rounding_share = 1e-9; /* of a strip's cost: what is less is a matter of rounding */

/* Two passes over the same walk: the first counts places, the second writes them. */
struct measurer {
	const struct metrics_input *input;
	struct trace *trace;
	bool writing;
	uint32_t places;
};

enum { CUTS_MAX = 4096 };

static void trace_point(struct measurer *measurer, uint32_t piece, struct vec2 point, bool lands)
{
	if (measurer->writing) {
		locator_find(measurer->input->locator, piece, point, &measurer->trace->place[measurer->places]);
		measurer->trace->lands[measurer->places] = lands;
	}
	measurer->places++;
}

static void trace_chord(struct measurer *measurer, uint32_t piece, struct vec2 a, struct vec2 b)
{
	double t[CUTS_MAX];
	uint32_t cuts = locator_cuts(measurer->input->locator, piece, a, b, t, CUTS_MAX);
	/* On a very fine mesh there may be more than were looked for. */
	if (cuts == CUTS_MAX) {
		struct vec2 middle = vec2_mix(a, b, 0.5);
		trace_chord(measurer, piece, a, middle);
		trace_chord(measurer, piece, middle, b);
		return;
	}
	for (uint32_t i = 0; i <= cuts; i++)
		trace_point(measurer, piece, i < cuts ? vec2_mix(a, b, t[i]) : b, false);
}

static void trace_span(struct measurer *measurer, const struct span *span)
{
	uint32_t parts = span_cuts(span, arc_step);
	struct vec2 at = span->from;
	for (uint32_t i = 1; i <= parts; i++) {
		struct vec2 to = span_point(span, (double)i / parts);
		trace_chord(measurer, span->piece, at, to);
		at = to;
	}
}

static void trace_all(struct measurer *measurer)
{
	const struct branch_set *branches = measurer->input->branches;
	measurer->places = 0;
	for (uint32_t b = 0; b < branches->branch_count; b++) {
		measurer->trace->first[b] = measurer->places;
		const struct wire *wire = &measurer->input->wires->wire[b];
		for (uint32_t s = 0; s < wire->span_count; s++) {
			const struct span *span = &wire->span[s];
			/* Where a wire changes its piece it stands at the same place of the mesh twice. */
			if (s == 0 || !wire_goes_on(span))
				trace_point(measurer, span->piece, span->from, s > 0);
			trace_span(measurer, span);
		}
	}
	measurer->trace->first[branches->branch_count] = measurer->places;
}

/* The length of the trace on the pattern; steps across a seam have none. */
static void measure_rest(const struct metrics_input *input, struct trace *trace)
{
	for (uint32_t b = 0; b < input->branches->branch_count; b++) {
		double length = 0;
		for (uint32_t i = trace->first[b] + 1; i < trace->first[b + 1]; i++) {
			const struct place *p = &trace->place[i - 1], *q = &trace->place[i];
			if (!trace->lands[i])
				length += vec2_distance(place_on_pattern(input->garment, p),
							place_on_pattern(input->garment, q));
		}
		trace->rest_mm[b] = length;
	}
}

static void strip_of_part(const struct metrics_input *input, const struct span *span, double t0, double t1,
			  struct strip *sum)
{
	struct vec2 quad[4];
	span_strip(span, t0, t1, input->field->options.strip_width_mm, quad);
	double corner[8];
	uint32_t count = 0;
	for (uint32_t i = 0; i < 4; i++) {
		if (i && vec2_distance(quad[i], quad[i - 1]) < 1e-12)
			continue;
		corner[2 * count] = quad[i].x;
		corner[2 * count + 1] = quad[i].y;
		count++;
	}
	struct place place;
	locator_find(input->locator, span->piece, span_point(span, (t0 + t1) / 2), &place);
	struct strip strip;
	strip_polygon(input->walker, place.face, corner, count, &strip);
	strip_add(sum, &strip);
}

/* What a part takes from a sum; where it is all of it, rounding leaves a little, of either sign, that is nothing. */
static double rest_of(double sum, double part)
{
	return sum - part > rounding_share * sum ? sum - part : 0;
}

/* Missing fabric is charged part by part, at the part's own largest density (method 3). */
static void measure_wire(const struct metrics_input *input, const struct wire *wire, struct branch_metrics *branch)
{
	const struct field_options *options = &input->field->options;
	double covered = 0, area = 0;
	*branch = (struct branch_metrics){.minimum_radius_mm = INFINITY};
	for (uint32_t s = 0; s < wire->span_count; s++) {
		const struct span *span = &wire->span[s];
		branch->length_mm += span_length(span);
		if (span_is_arc(span) && span->radius < branch->minimum_radius_mm)
			branch->minimum_radius_mm = span->radius;
		uint32_t parts = span_cuts(span, arc_step);
		for (uint32_t i = 0; i < parts; i++) {
			struct strip strip = {0};
			strip_of_part(input, span, (double)i / parts, (double)(i + 1) / parts, &strip);
			double cost = strip_cost(&strip, options->overhang);
			bool charged = options->overhang != FIELD_OVERHANG_IGNORE && strip.area_mm2 > strip.covered_mm2;
			branch->energy += cost;
			double eta_share = options->eta_mpa * (charged ? strip.area_mm2 : strip.covered_mm2);
			branch->energy_without_eta += rest_of(cost, eta_share);
			covered += strip.covered_mm2 < strip.area_mm2 ? strip.covered_mm2 : strip.area_mm2;
			area += strip.area_mm2;
		}
	}
	branch->coverage = area > 0 ? covered / area : 1;
}

static void sum_up(struct layout_metrics *metrics, const struct branch_set *branches)
{
	struct branch_metrics *total = &metrics->total;
	*total = (struct branch_metrics){.minimum_radius_mm = INFINITY};
	double covered = 0;
	for (uint32_t b = 0; b < branches->branch_count; b++) {
		const struct branch_metrics *branch = &metrics->branch[b];
		total->length_mm += branch->length_mm;
		total->energy += branch->energy;
		total->energy_without_eta += branch->energy_without_eta;
		covered += branch->coverage * branch->length_mm;
		if (branch->minimum_radius_mm < total->minimum_radius_mm)
			total->minimum_radius_mm = branch->minimum_radius_mm;
	}
	total->coverage = total->length_mm > 0 ? covered / total->length_mm : 1;
}

enum tw_status metrics_measure(struct layout_metrics *metrics, struct trace *trace, struct arena *arena,
			       const struct metrics_input *input, struct tw_error *error)
{
	uint32_t branches = input->branches->branch_count;
	*metrics = (struct layout_metrics){.junction_count = input->branches->junction_count,
					   .seam_crossings = input->wires->seam_crossings};
	metrics->branch = ARENA_ZEROED(arena, branches, struct branch_metrics);
	trace->first = ARENA_ARRAY(arena, branches + 1, uint32_t);
	trace->rest_mm = ARENA_ARRAY(arena, branches, double);
	if (!metrics->branch || !trace->first || !trace->rest_mm)
		return tw_fail_memory(error);
	struct measurer measurer = {.input = input, .trace = trace};
	trace_all(&measurer);
	trace->place = ARENA_ARRAY(arena, measurer.places, struct place);
	trace->lands = ARENA_ARRAY(arena, measurer.places, bool);
	if (!trace->place || !trace->lands)
		return tw_fail_memory(error);
	measurer.writing = true;
	trace_all(&measurer);
	measure_rest(input, trace);
	for (uint32_t b = 0; b < branches; b++)
		measure_wire(input, &input->wires->wire[b], &metrics->branch[b]);
	sum_up(metrics, input->branches);
	return TW_OK;
}

/* The energies of all layouts under one motion's densities, which `walker` integrates. */
static void take_energies(struct motion_energy *const *energy, const struct metrics_input *const *inputs,
			  uint32_t layout_count, struct strip_walker *walker, uint32_t motion)
{
	for (uint32_t l = 0; l < layout_count; l++) {
		struct metrics_input one = *inputs[l];
		struct motion_energy sum = {0, 0};
		one.walker = walker;
		for (uint32_t b = 0; b < one.branches->branch_count; b++) {
			struct branch_metrics branch;
			measure_wire(&one, &one.wires->wire[b], &branch);
			sum.energy += branch.energy;
			sum.without_eta += branch.energy_without_eta;
		}
		energy[l][motion] = sum;
	}
}

enum tw_status metrics_energies(struct layout_metrics *const *metrics, const struct metrics_input *const *inputs,
				uint32_t layout_count, const struct layout_input *input, const uint32_t *face,
				struct arena *arena, struct tw_error *error)
{
	const uint32_t faces = input->garment->face_count;
	struct motion_energy **energy = ARENA_ZEROED(arena, layout_count, struct motion_energy *);
	for (uint32_t l = 0; energy && l < layout_count; l++) {
		energy[l] = ARENA_ZEROED(arena, input->motion_count, struct motion_energy);
		metrics[l]->energy_by_motion = energy[l];
		if (!energy[l])
			return tw_fail_memory(error);
	}
	struct arena_mark mark = arena_mark(arena);
	double *value = ARENA_ARRAY(arena, faces, double), *density = ARENA_ARRAY(arena, faces, double);
	struct strip_fabric fabric = *inputs[0]->fabric;
	struct strip_walker *walker = NULL;
	fabric.value = value;
	enum tw_status status =
		energy && value && density ? strip_walker_new(&walker, arena, &fabric, error) : tw_fail_memory(error);
	for (uint32_t m = 0; m < input->motion_count && status == TW_OK; m++) {
		if (input->cancelled && input->cancelled(input->context))
			status = tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the layout was cancelled");
		if (status == TW_OK)
			status = input->motion_mean(input->context, m, density, error);
		for (uint32_t f = 0; status == TW_OK && f < faces; f++)
			value[f] = density[face[f]] + inputs[0]->field->options.eta_mpa;
		if (status == TW_OK)
			take_energies(energy, inputs, layout_count, walker, m);
	}
	arena_release(arena, mark);
	return status;
}
