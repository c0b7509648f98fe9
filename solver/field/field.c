/* Costs edge by edge, then one scale for all, then integers. The costs are shared out to threads; sums and the scale
 * are taken in the order of the edges afterwards, so that they do not depend on who computed what. */
#include "solver/field/field.h"

#include "solver/field/local.h"
#include "solver/field/strain.h"
#include "solver/field/strip.h"
#include "solver/garment/correspondence.h"
#include "solver/parallel.h"

#include <math.h>
#include <stdatomic.h>

enum {
	SMALLEST_BITS = 20, /* the smallest positive cost becomes at least 2^20 units */
	TOTAL_BITS = 59, /* the edges' weights together stay below 2^59 units; chords have some three times as many */
	EDGES_A_PART = 512,
};

/* What the threads share while they weigh. */
struct weighing {
	const struct garment *garment;
	const struct topology *topology;
	const struct field_options *options;
	const struct field_constraints *constraints; /* may be NULL */
	const uint32_t *edge_order;                  /* the edges one after the other; NULL: as they are numbered */
	struct strip_fabric fabric;                  /* under the walkers */
	struct strip_walker *walker[PARALLEL_THREADS];
	struct strip_walker *keep_out_walker[PARALLEL_THREADS]; /* integrate 1 over keep-outs; NULL without them */
	double seam_price;                                      /* MPa mm2 */
	const uint8_t *seam_vertex;                             /* [vertex_count]; NULL without a price */
	bool chords;                                            /* weigh the chords across the edges instead */
	double *cost;                                           /* [edge_count]; INFINITY where forbidden */
	float *coverage;                                        /* [edge_count] */
	const struct field_watch *watch;                        /* may be NULL */
	atomic_uint weighed;                                    /* edges */
	atomic_bool stop;                                       /* the watch said so */
};

static double side_length(const struct garment *garment, uint32_t face, uint8_t side)
{
	const uint32_t *coord = garment->face_coord + 3 * (size_t)face;
	const double *a = garment->pattern + 2 * (size_t)coord[side];
	const double *b = garment->pattern + 2 * (size_t)coord[side == 2 ? 0 : side + 1];
	return sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
}

static double rest_length(const struct weighing *w, uint32_t edge)
{
	const uint32_t *face = w->topology->edge_face + 2 * (size_t)edge;
	const uint8_t *side = w->topology->edge_side + 2 * (size_t)edge;
	double length = side_length(w->garment, face[0], side[0]);
	return w->topology->edge_kind[edge] == EDGE_SEAM ? 0.5 * (length + side_length(w->garment, face[1], side[1]))
							 : length;
}

/* Half a price for each of the two ends that lies on a seam. */
static double seam_cost(const struct weighing *w, const uint32_t *end)
{
	return w->seam_vertex ? 0.5 * w->seam_price * (w->seam_vertex[end[0]] + w->seam_vertex[end[1]]) : 0;
}

static bool is_forbidden(const struct weighing *w, unsigned thread, uint32_t edge, const struct strip *strip)
{
	const struct field_options *options = w->options;
	if (options->overhang == FIELD_OVERHANG_FORBID && 1 - strip_coverage(strip) > options->overhang_share)
		return true;
	if (!w->keep_out_walker[thread])
		return false;
	struct strip kept_out;
	strip_edge(w->keep_out_walker[thread], edge, options->strip_width_mm, &kept_out);
	return strip_touches(&kept_out);
}

static double edge_cost(const struct weighing *w, unsigned thread, uint32_t edge, const struct strip *strip)
{
	if (w->constraints && w->constraints->edge_free && w->constraints->edge_free[edge])
		return 0;
	if (is_forbidden(w, thread, edge, strip))
		return INFINITY;
	switch (w->options->weight) {
	case FIELD_UNIT:
		return 1;
	case FIELD_LENGTH:
		return rest_length(w, edge);
	default:
		return strip_cost(strip, w->options->overhang) +
		       seam_cost(w, w->topology->edge_vertex + 2 * (size_t)edge);
	}
}

/* A chord across a seam crosses it as a wire does that goes through one of its vertices. */
static double chord_cost(const struct weighing *w, unsigned thread, uint32_t edge, struct strip *strip)
{
	const struct field_options *options = w->options;
	struct strip_chord chord;
	if (!strip_chord(w->walker[thread], edge, options->strip_width_mm, strip))
		return INFINITY;
	if (options->overhang == FIELD_OVERHANG_FORBID && 1 - strip_coverage(strip) > options->overhang_share)
		return INFINITY;
	struct strip kept_out = {0};
	if (w->keep_out_walker[thread])
		strip_chord(w->keep_out_walker[thread], edge, options->strip_width_mm, &kept_out);
	if (strip_touches(&kept_out))
		return INFINITY;
	double cost = strip_cost(strip, options->overhang);
	if (w->seam_vertex && strip_find_chord(&w->fabric, edge, &chord))
		cost += seam_cost(w, chord.vertex);
	return w->seam_vertex && w->topology->edge_kind[edge] == EDGE_SEAM ? cost + w->seam_price : cost;
}

static void weigh_edges(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct weighing *w = context;
	if (atomic_load(&w->stop))
		return;
	for (uint32_t i = first; i < end; i++) {
		struct strip strip;
		uint32_t e = w->edge_order ? w->edge_order[i] : i;
		if (w->chords) {
			w->cost[e] = chord_cost(w, thread, e, &strip);
		} else {
			strip_edge(w->walker[thread], e, w->options->strip_width_mm, &strip);
			w->cost[e] = edge_cost(w, thread, e, &strip);
		}
		w->coverage[e] = (float)strip_coverage(&strip);
	}
	uint32_t weighed = atomic_fetch_add(&w->weighed, end - first) + end - first;
	if (thread == 0 && w->watch && w->watch->progress(w->watch->context, (double)weighed / w->topology->edge_count))
		atomic_store(&w->stop, true);
}

/* Coordinates or densities beyond all measure show here, whatever way they came in. */
static enum tw_status check_costs(const struct weighing *w, uint32_t count, struct tw_error *error)
{
	const double *cost = w->cost;
	double total = 0;
	for (uint32_t e = 0; e < count; e++) {
		total += cost[e] == INFINITY ? 0 : cost[e];
		if (!(total < 1e200)) {
			const uint32_t *end = w->topology->edge_vertex + 2 * (size_t)e;
			char name[2][VERTEX_NAME_BYTES], where[2 * VERTEX_NAME_BYTES + 16];
			snprintf(where, sizeof where, "vertices %s and %s",
				 garment_vertex_name(w->garment, end[0], name[0]),
				 garment_vertex_name(w->garment, end[1], name[1]));
			return tw_fail(
				error, TW_ERROR_INPUT, "field-cost", where,
				"the strip of the edge between them has no finite cost; check the unit of the pattern");
		}
	}
	return TW_OK;
}

/* The largest power of two that keeps the total in bounds, but no more than the smallest cost asks for. The total is
 * summed in integers, rounded up, so that it does not depend on the order of the edges. */
static double choose_scale(const double *cost, uint32_t count, int weight)
{
	double smallest = INFINITY, largest = 0;
	for (uint32_t e = 0; e < count; e++) {
		if (cost[e] > 0 && cost[e] < smallest)
			smallest = cost[e];
		if (cost[e] > largest && !isinf(cost[e]))
			largest = cost[e];
	}
	if (weight == FIELD_UNIT || largest == 0)
		return 1;
	int smallest_exponent, largest_exponent, total_exponent;
	frexp(smallest, &smallest_exponent);
	frexp(largest, &largest_exponent);
	const int unit_exponent = largest_exponent - 31; /* below 2^31 units each, and below 2^32 edges */
	uint64_t total = 0;
	for (uint32_t e = 0; e < count; e++)
		total += isinf(cost[e]) ? 0 : (uint64_t)ldexp(cost[e], -unit_exponent) + 1;
	frexp((double)total, &total_exponent);
	int wanted = SMALLEST_BITS + 1 - smallest_exponent, allowed = TOTAL_BITS - 1 - total_exponent - unit_exponent;
	return ldexp(1, wanted < allowed ? wanted : allowed);
}

double field_energy_scale(const struct field *field)
{
	return field->options.weight == FIELD_DEFORMATION ? field->scale : NAN;
}

uint64_t field_round(const struct field *field, double cost)
{
	double weight = cost * field->scale;
	return weight < 0x1p62 ? (uint64_t)(weight + 0.5) : FIELD_FORBIDDEN;
}

void field_value(const struct field *field, const struct field_constraints *constraints, double *value)
{
	const double *multiplier = constraints ? constraints->face_multiplier : NULL;
	for (uint32_t f = 0; f < field->face_count; f++)
		value[f] = (field->density[f] + field->options.eta_mpa) * (multiplier ? multiplier[f] : 1);
}

static enum tw_status check_input(const struct field *field, const struct garment *garment,
				  const struct field_constraints *constraints, struct tw_error *error)
{
	const double *multiplier = constraints ? constraints->face_multiplier : NULL;
	char where[32];
	if (isnan(field->options.eta_mpa))
		return tw_fail(error, TW_ERROR_INPUT, "field-eta", "/eta_mpa", "eta must be a number");
	for (uint32_t f = 0; f < field->face_count; f++) {
		snprintf(where, sizeof where, "face %u", garment_file_face(garment, f));
		if (!(field->density[f] >= 0 && field->density[f] <= 1e30))
			return tw_fail(error, TW_ERROR_INPUT, "field-density", where,
				       "the motions strain this face beyond all measure; check their unit");
		if (multiplier && !(multiplier[f] >= 0 && multiplier[f] <= 1e9))
			return tw_fail(error, TW_ERROR_INPUT, "field-multiplier", where,
				       "a face multiplier must be a number from 0 to 1e9");
	}
	return TW_OK;
}

static enum tw_status build_fabric(struct strip_fabric *fabric, struct arena *arena, const struct local *local,
				   const double *value, struct tw_error *error)
{
	const double *own = local_values(local, arena, value);
	return own ? strip_fabric_build(fabric, arena, &local->garment, &local->topology, own, error)
		   : tw_fail_memory(error);
}

/* The same fabric with the value 1 on what is kept out. */
static enum tw_status mark_keep_out(struct strip_fabric *marked, struct arena *arena, const struct strip_fabric *fabric,
				    const struct local *local, const uint8_t *keep_out, struct tw_error *error)
{
	const uint32_t faces = local->garment.face_count;
	double *value = ARENA_ARRAY(arena, faces, double);
	for (uint32_t f = 0; value && f < faces; f++)
		value[f] = keep_out[f] ? 1 : 0;
	*marked = *fabric;
	marked->value = value ? local_values(local, arena, value) : NULL;
	return marked->value ? TW_OK : tw_fail_memory(error);
}

/* Walkers for every thread that integrate `value`. */
static enum tw_status new_walkers(struct strip_walker **walker, struct arena *arena, const struct strip_fabric *fabric,
				  unsigned threads, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (unsigned t = 0; t < threads && status == TW_OK; t++)
		status = strip_walker_new(&walker[t], arena, fabric, error);
	return status;
}

static enum tw_status mark_seams(struct weighing *w, struct arena *arena, struct tw_error *error)
{
	if (!w->constraints || !(w->constraints->seam_price_mpa_mm2 > 0))
		return TW_OK;
	uint8_t *mark = ARENA_ZEROED(arena, w->garment->vertex_count, uint8_t);
	if (!mark)
		return tw_fail_memory(error);
	for (size_t e = 0; e < w->topology->edge_count; e++)
		if (w->topology->edge_kind[e] == EDGE_SEAM)
			mark[w->topology->edge_vertex[2 * e]] = mark[w->topology->edge_vertex[2 * e + 1]] = 1;
	w->seam_vertex = mark;
	w->seam_price = w->constraints->seam_price_mpa_mm2;
	return TW_OK;
}

static enum tw_status weigh(struct weighing *w, struct arena *arena, const struct field *field, unsigned threads,
			    struct tw_error *error)
{
	const uint8_t *keep_out = w->constraints ? w->constraints->face_keep_out : NULL;
	double *value = ARENA_ARRAY(arena, field->face_count, double);
	struct strip_fabric keep_out_fabric;
	struct local local;
	if (!value)
		return tw_fail_memory(error);
	field_value(field, w->constraints, value);
	enum tw_status status = local_build(&local, arena, w->garment, w->topology, error);
	w->edge_order = status != TW_OK ? NULL : local.edge_order;
	if (status == TW_OK)
		status = build_fabric(&w->fabric, arena, &local, value, error);
	if (status == TW_OK)
		status = new_walkers(w->walker, arena, &w->fabric, threads, error);
	if (status == TW_OK)
		status = mark_seams(w, arena, error);
	if (status == TW_OK && keep_out)
		status = mark_keep_out(&keep_out_fabric, arena, &w->fabric, &local, keep_out, error);
	if (status == TW_OK && keep_out)
		status = new_walkers(w->keep_out_walker, arena, &keep_out_fabric, threads, error);
	if (status == TW_OK)
		parallel_for(threads, field->edge_count, EDGES_A_PART, weigh_edges, w);
	if (status == TW_OK && atomic_load(&w->stop))
		status = tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the weighing was cancelled");
	return status;
}

enum tw_status field_weigh_watched(struct field *field, struct arena *arena, const struct garment *garment,
				   const struct topology *topology, const double *density,
				   const struct field_options *options, const struct field_constraints *constraints,
				   unsigned threads, const struct field_watch *watch, struct tw_error *error)
{
	uint64_t *weight = ARENA_ARRAY(arena, topology->edge_count, uint64_t);
	float *coverage = ARENA_ARRAY(arena, topology->edge_count, float);
	*field = (struct field){
		.face_count = garment->face_count,
		.edge_count = topology->edge_count,
		.options = *options,
		.density = density,
		.weight = weight,
		.coverage = coverage,
	};
	enum tw_status status = check_input(field, garment, constraints, error);
	if (status != TW_OK)
		return status;
	struct arena_mark mark = arena_mark(arena);
	struct weighing w = {
		.garment = garment,
		.topology = topology,
		.options = &field->options,
		.constraints = constraints,
		.cost = ARENA_ARRAY(arena, topology->edge_count, double),
		.coverage = coverage,
		.watch = watch,
	};
	threads = threads < 1 ? 1 : threads > PARALLEL_THREADS ? PARALLEL_THREADS : threads;
	status = weight && coverage && w.cost ? weigh(&w, arena, field, threads, error) : tw_fail_memory(error);
	if (status == TW_OK)
		status = check_costs(&w, field->edge_count, error);
	if (status == TW_OK) {
		field->scale = choose_scale(w.cost, field->edge_count, field->options.weight);
		for (uint32_t e = 0; e < field->edge_count; e++)
			weight[e] = field_round(field, w.cost[e]);
	}
	arena_release(arena, mark);
	return status;
}

enum tw_status field_weigh_chords(struct field *field, struct arena *arena, const struct garment *garment,
				  const struct topology *topology, const struct field_constraints *constraints,
				  unsigned threads, const struct field_watch *watch, struct tw_error *error)
{
	if (field->options.weight != FIELD_DEFORMATION)
		return TW_OK;
	uint64_t *weight = ARENA_ARRAY(arena, field->edge_count, uint64_t);
	float *coverage = ARENA_ARRAY(arena, field->edge_count, float);
	struct arena_mark mark = arena_mark(arena);
	struct weighing w = {
		.garment = garment,
		.topology = topology,
		.options = &field->options,
		.constraints = constraints,
		.chords = true,
		.cost = ARENA_ARRAY(arena, field->edge_count, double),
		.coverage = coverage,
		.watch = watch,
	};
	threads = threads < 1 ? 1 : threads > PARALLEL_THREADS ? PARALLEL_THREADS : threads;
	enum tw_status status =
		weight && coverage && w.cost ? weigh(&w, arena, field, threads, error) : tw_fail_memory(error);
	if (status == TW_OK)
		status = check_costs(&w, field->edge_count, error);
	for (uint32_t e = 0; status == TW_OK && e < field->edge_count; e++)
		weight[e] = field_round(field, w.cost[e]);
	arena_release(arena, mark);
	field->chord_weight = weight;
	field->chord_coverage = coverage;
	return status;
}

enum tw_status field_weigh(struct field *field, struct arena *arena, const struct garment *garment,
			   const struct topology *topology, const double *density, const struct field_options *options,
			   const struct field_constraints *constraints, unsigned threads, struct tw_error *error)
{
	return field_weigh_watched(field, arena, garment, topology, density, options, constraints, threads, NULL,
				   error);
}

enum tw_status field_compute(struct field *field, struct arena *arena, const struct garment *garment,
			     const struct topology *topology, const double *const *mean, size_t motion_count,
			     const struct field_options *options, unsigned threads, struct tw_error *error)
{
	double *density = ARENA_ARRAY(arena, garment->face_count, double);
	if (!density)
		return tw_fail_memory(error);
	strain_worst(mean, motion_count, garment->face_count, density);
	return field_weigh(field, arena, garment, topology, density, options, NULL, threads, error);
}
