/* Units that cannot be right, from sizes alone: a garment is as long as an arm or a person, and its pattern has about
 * its area. Nearly everything else that is wrong with a mesh looks different in another unit, so this is judged first.
 */
#include "solver/garment/draft.h"

#include <math.h>

/* A garment's largest extent, mm: what none has is refused, what few have is said. */
static const double least_mm = 60, small_mm = 200, large_mm = 3000, largest_mm = 10000;
/* What most have, by which a unit is suggested. */
static const double usual_least_mm = 250, usual_largest_mm = 2500;

static const struct {
	const char *name, *words;
	double mm;
} units[] = {{"mm", "millimetres", 1}, {"cm", "centimetres", 10}, {"m", "metres", 1000}};
enum { UNITS = sizeof units / sizeof *units };

static double extent_of(const double *points, uint32_t count, size_t axes)
{
	double largest = 0;
	for (size_t axis = 0; axis < axes; axis++) {
		double low = INFINITY, high = -INFINITY;
		for (size_t i = 0; i < count; i++) {
			low = fmin(low, points[axes * i + axis]);
			high = fmax(high, points[axes * i + axis]);
		}
		largest = fmax(largest, high - low);
	}
	return largest;
}

/* The unit in which a length of the file is that of a garment; UNITS for none. */
static int unit_for(double length, double least, double largest)
{
	int unit = 0;
	while (unit < UNITS && (length * units[unit].mm < least || length * units[unit].mm > largest))
		unit++;
	return unit;
}

/* What is long in every unit is so by a vertex far from the others. */
static enum tw_status refuse_vertex(const struct draft *draft, const struct soup *worn, double length, double mm)
{
	double middle[3] = {0}, farthest = 0;
	uint32_t vertex = 0;
	char where[32];
	for (size_t i = 0; i < 3 * (size_t)worn->vertex_count; i++)
		middle[i % 3] += worn->position[i] / worn->vertex_count;
	for (uint32_t v = 0; v < worn->vertex_count; v++) {
		double square = 0;
		for (size_t axis = 0; axis < 3; axis++)
			square += pow(worn->position[3 * (size_t)v + axis] - middle[axis], 2);
		vertex = square > farthest ? v : vertex;
		farthest = fmax(farthest, square);
	}
	snprintf(where, sizeof where, "vertex %u", vertex);
	return tw_fail(draft->error, TW_ERROR_INPUT, "coordinate-too-large", where,
		       "the garment is %.4g mm long, which no garment is in any unit; vertex %u lies %.4g mm from its "
		       "middle",
		       length * mm, vertex, sqrt(farthest) * mm);
}

static enum tw_status refuse_unit(const struct draft *draft, const struct soup *worn, double length, double mm,
				  bool with_pattern)
{
	int unit = unit_for(length, usual_least_mm, usual_largest_mm);
	if (unit == UNITS)
		unit = unit_for(length, least_mm, largest_mm);
	if (unit == UNITS && length * mm > largest_mm)
		return refuse_vertex(draft, worn, length, mm);
	if (unit == UNITS)
		return tw_fail(
			draft->error, TW_ERROR_INPUT, "mesh-unit", "unit",
			"the garment is %.4g mm long, which no garment is in any unit that is known here; scale it",
			length * mm);
	return tw_fail(
		draft->error, TW_ERROR_INPUT, "mesh-unit", "unit",
		"the garment is %.1f mm long, which no garment is: the file looks like %s; import it with unit = "
		"%s%s%s",
		length * mm, units[unit].words, units[unit].name, with_pattern ? " and pattern_unit = " : "",
		with_pattern ? units[unit].name : "");
}

enum tw_status draft_check_unit(struct draft *draft, const struct soup *worn, const struct soup *pattern,
				const struct import_options *options)
{
	const double mm = units[options->unit].mm, length = extent_of(worn->position, worn->vertex_count, 3);
	const double flat = pattern ? extent_of(pattern->position, pattern->vertex_count, 3)
				    : extent_of(worn->coord, worn->coord_count, 2);
	/* A flat pattern of pieces side by side is up to some times as wide as the garment. */
	bool same = flat > length / 8 && flat < 8 * length && options->pattern_unit == options->unit;
	if (length * mm < least_mm || length * mm > largest_mm)
		return refuse_unit(draft, worn, length, mm, same);
	int other = unit_for(length, usual_least_mm, usual_largest_mm);
	if (length * mm < small_mm || length * mm > large_mm)
		warning_add_whole(&draft->report->warnings, "size-unusual",
				  "the garment is %.0f mm long, which is unusual%s%s; check the unit", length * mm,
				  other < UNITS ? ": the file could be in " : "",
				  other < UNITS ? units[other].words : "");
	return TW_OK;
}

static double worn_area(const struct garment *garment, uint32_t face)
{
	const uint32_t *v = garment->face_vertex + 3 * (size_t)face;
	double u[3], w[3];
	for (size_t axis = 0; axis < 3; axis++) {
		double origin = garment->position[3 * (size_t)v[0] + axis];
		u[axis] = garment->position[3 * (size_t)v[1] + axis] - origin;
		w[axis] = garment->position[3 * (size_t)v[2] + axis] - origin;
	}
	double x = u[1] * w[2] - u[2] * w[1], y = u[2] * w[0] - u[0] * w[2], z = u[0] * w[1] - u[1] * w[0];
	return 0.5 * sqrt(x * x + y * y + z * z);
}

static bool is_unit_square(const struct garment *garment, double mm)
{
	for (size_t i = 0; i < 2 * (size_t)garment->coord_count; i++) {
		if (garment->pattern[i] < -0.01 * mm || garment->pattern[i] > 1.01 * mm)
			return false;
	}
	return true;
}

/* `ratio`: worn area over the pattern's. Whichever of the two gets a unit in which the areas fit; the worn mesh where
 * its size is not a usual one. */
static enum tw_status refuse_pattern_unit(const struct draft *draft, double ratio, const struct import_options *options,
					  bool usual_size)
{
	const int pattern_unit = options->pattern_unit;
	const struct garment *garment = &draft->garment;
	const char *place = "pattern_unit"; /* the one to change */
	char hint[96] = "set unit and pattern_unit";
	const double mm = pattern_unit == UNIT_SHEET ? 0 : units[pattern_unit].mm;
	if (mm > 0 && is_unit_square(garment, mm))
		snprintf(hint, sizeof hint, "its coordinates run from 0 to 1: import it with pattern_unit = sheet");
	for (int unit = 0; mm > 0 && unit < UNITS; unit++) {
		double other = ratio * (mm / units[unit].mm) * (mm / units[unit].mm);
		if (other > 0.25 && other < 4) {
			snprintf(hint, sizeof hint, "the pattern looks like %s: import it with pattern_unit = %s",
				 units[unit].words, units[unit].name);
			place = "pattern_unit";
		}
		other = ratio * (units[unit].mm / units[options->unit].mm) * (units[unit].mm / units[options->unit].mm);
		if (!usual_size && other > 0.25 && other < 4) {
			snprintf(hint, sizeof hint, "the worn mesh looks like %s: import it with unit = %s",
				 units[unit].words, units[unit].name);
			place = "unit";
		}
	}
	return tw_fail(draft->error, TW_ERROR_INPUT, "pattern-scale", place,
		       "the worn mesh has %.2f mm2, the flat pattern %.2f mm2, which no fabric stretches to; %s",
		       draft->report->worn_area_mm2, draft->report->pattern_area_mm2, hint);
}

enum tw_status draft_check_scale(struct draft *draft, const struct import_options *options)
{
	const struct garment *garment = &draft->garment;
	struct garment_report *report = draft->report;
	report->worn_area_mm2 = report->pattern_area_mm2 = 0;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		report->worn_area_mm2 += worn_area(garment, f);
		report->pattern_area_mm2 += 0.5 * fabs(draft_face_cross(draft, f));
	}
	/* A pattern in other units is off by far more than any fabric stretches. Without area it is no pattern, which
	 * is told of its faces. */
	double ratio = report->worn_area_mm2 / report->pattern_area_mm2;
	if (!(report->pattern_area_mm2 > 0) || (ratio <= 25 && ratio >= 1.0 / 25))
		return TW_OK;
	double length = extent_of(garment->position, garment->vertex_count, 3);
	return refuse_pattern_unit(draft, ratio, options, length >= usual_least_mm && length <= usual_largest_mm);
}
