#include "solver/layout/rules.h"

#include <assert.h>
#include <string.h>

static const double cut_tolerance_mm = 0.25;   /* that a curve may leave its piece by: less than a cutter's */
static const double area_tolerance_mm2 = 0.1;  /* that strips may cover of what they must not: rounding of curves */
static const double stray_step_mm = 1;         /* between the points of a curve that are looked at */
static const double tolerance_slack_mm = 1e-3; /* of the tolerance: what lies on its limit keeps it */

struct checker {
	const struct rules_input *input;
	struct violation_list *list;
	struct arena *arena;
	struct tw_error *error;
};

static const struct {
	const char *name, *unit, *warning;
} names[] = {
	[RULE_MINIMUM_RADIUS] = {"minimum_radius", "mm", "rule-minimum-radius"},
	[RULE_OFF_PIECE] = {"off_piece", "mm", "rule-off-piece"},
	[RULE_KEEP_OUT] = {"keep_out", "mm2", "rule-keep-out"},
	[RULE_TOLERANCE] = {"tolerance", "mm", "rule-tolerance"},
	[RULE_STRIP_OVERLAP] = {"strip_overlap", "mm2", "rule-strip-overlap"},
	[RULE_SEAM_CORNER] = {"seam_corner", "mm", "rule-seam-corner"},
	[RULE_TREE_CROSSING] = {"tree_crossing", "mm", "rule-tree-crossing"},
};
_Static_assert(sizeof names / sizeof *names == RULE_COUNT, "every rule has a name");

const char *rule_name(enum design_rule rule)
{
	return names[rule].name;
}

const char *rule_unit(enum design_rule rule)
{
	return names[rule].unit;
}

static void warn(const struct violation *worst, const char *piece, uint32_t branch, struct warning_list *warnings)
{
	const char *type = names[worst->rule].warning;
	double value = worst->value, u = worst->at.x, v = worst->at.y;
	switch (worst->rule) {
	case RULE_MINIMUM_RADIUS:
		warning_add(warnings, type, "branch", branch,
			    "a curve is tighter than the smallest radius of %.1f mm: %.1f mm, branch %u at (%.0f, "
			    "%.0f) on %.80s",
			    worst->limit, value, worst->branch, u, v, piece);
		break;
	case RULE_OFF_PIECE:
		warning_add(warnings, type, "branch", branch,
			    "a curve leaves its piece: by %.1f mm, branch %u at (%.0f, %.0f) on %.80s", value,
			    worst->branch, u, v, piece);
		break;
	case RULE_KEEP_OUT:
		warning_add(warnings, type, "branch", branch,
			    "a strip covers what is kept out: %.1f mm², branch %u at (%.0f, %.0f) on %.80s", value,
			    worst->branch, u, v, piece);
		break;
	case RULE_TOLERANCE:
		warning_add(
			warnings, type, "branch", branch,
			"a curve strays from the tree's path by more than %.1f mm: %.1f mm, branch %u at (%.0f, %.0f) "
			"on %.80s",
			worst->limit, value, worst->branch, u, v, piece);
		break;
	case RULE_STRIP_OVERLAP:
		warning_add(warnings, type, "branch", branch,
			    "strips that do not meet are nearer than they may be: branches %u and %u share %.1f mm² at "
			    "(%.0f, "
			    "%.0f) on %.80s",
			    worst->branch, worst->other, value, u, v, piece);
		break;
	case RULE_SEAM_CORNER:
		warning_add(warnings, type, "branch", branch,
			    "a wire runs through a point where more than two pieces meet: branch %u at (%.0f, %.0f) on "
			    "%.80s",
			    worst->branch, u, v, piece);
		break;
	case RULE_TREE_CROSSING:
		warning_add(warnings, type, "branch", branch,
			    "two edges of the tree cross: branches %u and %u at (%.0f, %.0f) on %.80s", worst->branch,
			    worst->other, u, v, piece);
		break;
	case RULE_COUNT:
		break;
	}
}

/* Small radii and small distances from a corner are the bad ones. */
static bool is_worse(const struct violation *a, const struct violation *b)
{
	bool less_is_worse = a->rule == RULE_MINIMUM_RADIUS || a->rule == RULE_SEAM_CORNER;
	return less_is_worse ? a->value < b->value : a->value > b->value;
}

void rules_warn(const struct violation_list *list, const struct garment *garment, struct warning_list *warnings)
{
	for (uint32_t rule = 0; rule < RULE_COUNT; rule++) {
		const struct violation *worst = NULL;
		for (uint32_t i = 0; i < list->count; i++)
			if (list->violation[i].rule == rule && (!worst || is_worse(&list->violation[i], worst)))
				worst = &list->violation[i];
		for (uint32_t i = 0; worst && i < list->count; i++)
			if (list->violation[i].rule == rule)
				warn(worst, garment->piece_name[worst->piece], list->violation[i].branch, warnings);
	}
}

static enum tw_status add(struct checker *checker, const struct violation *violation)
{
	struct violation_list *list = checker->list;
	if (list->count == list->room) {
		uint32_t room = list->room ? 2 * list->room : 8;
		struct violation *more = ARENA_ARRAY(checker->arena, room, struct violation);
		if (!more)
			return tw_fail_memory(checker->error);
		if (list->count)
			memcpy(more, list->violation, list->count * sizeof *more);
		list->violation = more;
		list->room = room;
	}
	list->violation[list->count++] = *violation;
	return TW_OK;
}

/* --- curves ------------------------------------------------------------------------------------------------------- */

static enum tw_status check_radius(struct checker *checker, uint32_t branch, const struct span *span)
{
	double limit = checker->input->rules->minimum_radius_mm;
	if (!span_is_arc(span) || span->radius >= limit * (1 - 1e-9))
		return TW_OK;
	return add(checker, &(struct violation){RULE_MINIMUM_RADIUS, branch, GARMENT_NONE, span->piece,
						span_point(span, 0.5), span->radius, limit});
}

static enum tw_status check_piece(struct checker *checker, uint32_t branch, const struct span *span)
{
	struct violation worst = {RULE_OFF_PIECE, branch, GARMENT_NONE, span->piece, span->from, 0, cut_tolerance_mm};
	uint32_t steps = (uint32_t)(span_length(span) / stray_step_mm) + 1;
	for (uint32_t i = 0; i <= steps; i++) {
		struct vec2 point = span_point(span, (double)i / steps);
		struct place place;
		locator_find(checker->input->locator, span->piece, point, &place);
		if (place.distance > worst.value) {
			worst.value = place.distance;
			worst.at = point;
		}
	}
	return worst.value > cut_tolerance_mm ? add(checker, &worst) : TW_OK;
}

static enum tw_status check_spans(struct checker *checker,
				  enum tw_status (*check)(struct checker *checker, uint32_t branch,
							  const struct span *span))
{
	enum tw_status status = TW_OK;
	for (uint32_t b = 0; b < checker->input->branches->branch_count; b++) {
		const struct wire *wire = &checker->input->wires->wire[b];
		for (uint32_t s = 0; s < wire->span_count && status == TW_OK; s++)
			status = check(checker, b, &wire->span[s]);
	}
	return status;
}

static enum tw_status check_tolerance(struct checker *checker)
{
	double limit = checker->input->rules->tolerance_mm;
	enum tw_status status = TW_OK;
	for (uint32_t b = 0; b < checker->input->branches->branch_count && status == TW_OK; b++) {
		const struct wire_stray *stray = &checker->input->wires->wire[b].stray;
		if (stray->distance_mm > limit + tolerance_slack_mm)
			status = add(checker, &(struct violation){RULE_TOLERANCE, b, GARMENT_NONE, stray->piece,
								  stray->at, stray->distance_mm, limit});
	}
	return status;
}

/* --- keep-outs ---------------------------------------------------------------------------------------------------- */

struct box {
	struct vec2 low, high;
};

static struct box box_around(const struct vec2 *point, uint32_t count)
{
	struct box box = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
	for (uint32_t i = 0; i < count; i++) {
		box.low = (struct vec2){fmin(box.low.x, point[i].x), fmin(box.low.y, point[i].y)};
		box.high = (struct vec2){fmax(box.high.x, point[i].x), fmax(box.high.y, point[i].y)};
	}
	return box;
}

static bool boxes_meet(const struct box *a, const struct box *b)
{
	return a->low.x <= b->high.x && b->low.x <= a->high.x && a->low.y <= b->high.y && b->low.y <= a->high.y;
}

/* The faces of a piece that are kept out and near a box, as loops that share their sides. */
static void collect_keep_outs(const struct checker *checker, uint32_t piece, const struct box *near,
			      struct region_builder *builder)
{
	const struct garment *garment = checker->input->network->garment;
	const uint8_t *keep_out = checker->input->rules->face_keep_out;
	region_start(builder, checker->arena);
	for (uint32_t f = 0; f < garment->face_count; f++) {
		struct vec2 corner[3];
		if (!keep_out[f] || garment->face_piece[f] != piece)
			continue;
		for (uint32_t k = 0; k < 3; k++) {
			const double *uv = &garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)f + k]];
			corner[k] = (struct vec2){uv[0], uv[1]};
		}
		const struct box box = box_around(corner, 3);
		if (!boxes_meet(&box, near))
			continue;
		region_begin_loop(builder);
		for (uint32_t k = 0; k < 3; k++)
			region_add_point(builder, corner[k]);
	}
}

/* The area that two regions have in common, and the middle of its largest part. */
static enum tw_status measure_common(const struct checker *checker, const struct region *a, const struct region *b,
				     double *area, struct vec2 *at)
{
	struct region common;
	double largest = 0;
	*area = 0;
	enum tw_status status = region_combine(&common, checker->arena, checker->input->cutter->scratch, a, b,
					       REGION_COMMON, checker->error);
	for (uint32_t l = 0; status == TW_OK && l < common.loop_count; l++) {
		struct vec2 centroid;
		double part = region_loop_area(&common, l, &centroid);
		*area += part;
		if (part > largest) {
			largest = part;
			*at = centroid;
		}
	}
	return status;
}

static enum tw_status check_keep_out_area(struct checker *checker, uint32_t branch, const struct strip_area *strip)
{
	struct violation violation = {RULE_KEEP_OUT, branch, GARMENT_NONE, strip->piece, {0, 0}, 0, 0};
	struct region_builder kept_out;
	const struct box box = {strip->low, strip->high};
	collect_keep_outs(checker, strip->piece, &box, &kept_out);
	if (kept_out.failed)
		return tw_fail_memory(checker->error);
	if (!kept_out.region.loop_count)
		return TW_OK;
	enum tw_status status =
		measure_common(checker, &strip->region, &kept_out.region, &violation.value, &violation.at);
	return status == TW_OK && violation.value > area_tolerance_mm2 ? add(checker, &violation) : status;
}

static enum tw_status check_keep_outs(struct checker *checker)
{
	const struct rules_input *input = checker->input;
	enum tw_status status = TW_OK;
	if (!input->rules->face_keep_out)
		return TW_OK;
	for (uint32_t b = 0; b < input->branches->branch_count; b++)
		for (uint32_t i = 0; i < input->strips[b].count && status == TW_OK; i++)
			status = check_keep_out_area(checker, b, &input->strips[b].area[i]);
	return status;
}

/* --- strips on one another ---------------------------------------------------------------------------------------- */

/* How two branches lie to one another in the tree. */
struct relation {
	uint32_t facing[2]; /* which end of each faces the other, 0 or 1 */
	double between_mm;  /* length of wire between these ends; INFINITY for more than matters */
};

static double wire_length(const struct wire *wire)
{
	double length = 0;
	for (uint32_t s = 0; s < wire->span_count; s++)
		length += span_length(&wire->span[s]);
	return length;
}

/* Walks from an end of a branch, over no more wire than matters, and notes how every branch on the way is met. */
struct walk {
	const struct checker *checker;
	const double *length;      /* [branch_count] */
	struct relation *relation; /* [branch_count] to the branch at which the walk began */
	double limit;
};

struct walk_step {
	uint32_t end, came_by; /* an end, and the branch by which it was reached */
	double walked;
};

static void note_branches(const struct walk *walk, const struct walk_step *at, uint32_t facing, struct walk_step *stack,
			  uint32_t *depth)
{
	const struct branch_set *branches = walk->checker->input->branches;
	for (uint32_t b = 0; b < branches->branch_count; b++) {
		const struct branch *branch = &branches->branch[b];
		if (b == at->came_by || (branch->end[0] != at->end && branch->end[1] != at->end))
			continue;
		uint32_t which = branch->end[1] == at->end;
		walk->relation[b] = (struct relation){{facing, which}, at->walked};
		/* A tree leads to every branch in one way only. */
		assert(*depth <= branches->branch_count);
		if (at->walked + walk->length[b] < walk->limit)
			stack[(*depth)++] = (struct walk_step){branch->end[!which], b, at->walked + walk->length[b]};
	}
}

/* `stack`: room for every branch. */
static void relate(const struct walk *walk, uint32_t first, struct walk_step *stack)
{
	const struct branch_set *branches = walk->checker->input->branches;
	for (uint32_t b = 0; b < branches->branch_count; b++)
		walk->relation[b].between_mm = INFINITY;
	for (uint32_t facing = 0; facing < 2; facing++) {
		uint32_t depth = 0;
		assert(first < branches->branch_count);
		stack[depth++] = (struct walk_step){branches->branch[first].end[facing], first, 0};
		while (depth > 0) {
			struct walk_step at = stack[--depth];
			note_branches(walk, &at, facing, stack, &depth);
		}
	}
}

/* The wire without its first or last millimetres. */
static enum tw_status shorten(const struct checker *checker, const struct wire *wire, uint32_t end, double off,
			      struct wire *rest)
{
	double low = end == 0 ? off : 0, high = wire_length(wire) - (end == 0 ? 0 : off), run = 0;
	*rest = (struct wire){.span = ARENA_ARRAY(checker->arena, wire->span_count, struct span)};
	if (!rest->span)
		return tw_fail_memory(checker->error);
	for (uint32_t s = 0; s < wire->span_count; s++) {
		double length = span_length(&wire->span[s]);
		double from = fmax(0, low - run), to = fmin(length, high - run);
		run += length;
		if (to - from > 1e-6)
			rest->span[rest->span_count++] = span_part(&wire->span[s], from / length, to / length);
	}
	return TW_OK;
}

/* Strips are looked at in the width that spacing asks for. */
struct overlap {
	struct checker *checker;
	const struct strip_areas *strips; /* [branch_count] */
	double width;
	double meeting_mm; /* of wire, along which strips may overlap */
};

static enum tw_status common_of(const struct overlap *overlap, const struct strip_areas *a, const struct strip_areas *b,
				uint32_t branch, uint32_t other, bool *found, bool report)
{
	enum tw_status status = TW_OK;
	*found = false;
	for (uint32_t i = 0; i < a->count; i++)
		for (uint32_t j = 0; j < b->count && status == TW_OK; j++) {
			const struct box box = {a->area[i].low, a->area[i].high};
			const struct box other_box = {b->area[j].low, b->area[j].high};
			struct violation violation = {
				RULE_STRIP_OVERLAP, branch, other, a->area[i].piece, {0, 0}, 0, 0};
			if (a->area[i].piece != b->area[j].piece || !boxes_meet(&box, &other_box))
				continue;
			status = measure_common(overlap->checker, &a->area[i].region, &b->area[j].region,
						&violation.value, &violation.at);
			if (status != TW_OK || violation.value <= area_tolerance_mm2)
				continue;
			*found = true;
			if (report)
				status = add(overlap->checker, &violation);
		}
	return status;
}

static enum tw_status cut_shortened(const struct overlap *overlap, uint32_t branch, uint32_t end, double off,
				    struct strip_areas *areas)
{
	struct checker *checker = overlap->checker;
	struct wire rest;
	enum tw_status status = shorten(checker, &checker->input->wires->wire[branch], end, off, &rest);
	return status == TW_OK ? strips_cut(checker->input->cutter, &rest, overlap->width, areas, checker->error)
			       : status;
}

static enum tw_status check_pair(const struct overlap *overlap, uint32_t a, uint32_t b, const struct relation *relation)
{
	double off = (overlap->meeting_mm - relation->between_mm) / 2;
	struct strip_areas first, second;
	bool found, meet = off > 0;
	enum tw_status status = common_of(overlap, &overlap->strips[a], &overlap->strips[b], a, b, &found, !meet);
	if (status != TW_OK || !found || !meet)
		return status;
	status = cut_shortened(overlap, a, relation->facing[0], off, &first);
	if (status == TW_OK)
		status = cut_shortened(overlap, b, relation->facing[1], off, &second);
	return status == TW_OK ? common_of(overlap, &first, &second, a, b, &found, true) : status;
}

static enum tw_status check_overlaps(struct checker *checker)
{
	const struct rules_input *input = checker->input;
	uint32_t count = input->branches->branch_count;
	struct overlap overlap = {checker, input->strips, input->rules->strip_width_mm + input->rules->spacing_mm,
				  RULES_MEETING_WIDTHS * input->rules->strip_width_mm};
	double *length = ARENA_ARRAY(checker->arena, count, double);
	struct relation *relation = ARENA_ARRAY(checker->arena, count, struct relation);
	struct walk_step *stack = ARENA_ARRAY(checker->arena, (size_t)count + 1, struct walk_step);
	struct strip_areas *wide;
	enum tw_status status = TW_OK;
	if (!length || !relation || !stack)
		return tw_fail_memory(checker->error);
	if (input->rules->spacing_mm > 0) {
		status = strips_cut_all(input->cutter, input->wires->wire, count, overlap.width, &wide, checker->error);
		overlap.strips = wide;
	}
	for (uint32_t b = 0; b < count; b++)
		length[b] = wire_length(&input->wires->wire[b]);
	const struct walk walk = {checker, length, relation, overlap.meeting_mm};
	for (uint32_t a = 0; a < count; a++) {
		relate(&walk, a, stack);
		for (uint32_t b = a + 1; b < count && status == TW_OK; b++)
			status = check_pair(&overlap, a, b, &relation[b]);
	}
	return status;
}

/* --- corners of pieces -------------------------------------------------------------------------------------------- */

/* The place of every vertex at which more than two pieces meet, on every piece, unless a terminal is there. */
static enum tw_status check_corner(struct checker *checker, uint32_t piece, struct vec2 corner)
{
	const struct rules_input *input = checker->input;
	double limit = NETWORK_CORNER_WIDTHS * input->rules->strip_width_mm;
	enum tw_status status = TW_OK;
	for (uint32_t b = 0; b < input->branches->branch_count && status == TW_OK; b++) {
		struct violation nearest = {RULE_SEAM_CORNER, b, GARMENT_NONE, piece, corner, INFINITY, limit};
		for (uint32_t s = 0; s < input->wires->wire[b].span_count; s++) {
			const struct span *span = &input->wires->wire[b].span[s];
			if (span->piece == piece)
				nearest.value =
					fmin(nearest.value,
					     vec2_distance(corner, span_point(span, span_nearest(span, corner))));
		}
		if (nearest.value < limit)
			status = add(checker, &nearest);
	}
	return status;
}

static enum tw_status check_corners(struct checker *checker)
{
	const struct network *network = checker->input->network;
	const struct garment *garment = network->garment;
	bool *seen = ARENA_ZEROED(checker->arena, garment->coord_count, bool);
	enum tw_status status = seen ? TW_OK : tw_fail_memory(checker->error);
	for (size_t c = 0; c < 3 * (size_t)garment->face_count && status == TW_OK; c++) {
		uint32_t vertex = garment->face_vertex[c], coord = garment->face_coord[c];
		if (!network->corner[vertex] || seen[coord])
			continue;
		seen[coord] = true;
		const double *uv = &garment->pattern[2 * (size_t)coord];
		status = check_corner(checker, garment->face_piece[c / 3], (struct vec2){uv[0], uv[1]});
	}
	return status;
}

/* --- the tree ------------------------------------------------------------------------------------------------------
 */

/* Half of a chord: from a vertex to the edge that it crosses, through one face. */
struct half_chord {
	uint32_t branch;
	struct laid_edge laid;
};

/* What of a tree was met so far. */
struct tree_check {
	const struct network *network;
	struct half_chord *half; /* [half_count] */
	uint32_t half_count;
	uint32_t *in_face;   /* [face_count] the half that passes the face, GARMENT_NONE */
	uint32_t *branch_on; /* [mesh edge_count] the branch that runs along the edge, GARMENT_NONE */
};

static bool is_crossing_node(const struct network *network, uint32_t node)
{
	return node >= network->garment->vertex_count + network->extra_count;
}

/* Where two halves in one face cross, each from a corner to the opposite side. */
static struct vec2 meet(const struct laid_edge *a, const struct laid_edge *b)
{
	struct vec2 d = vec2_sub(a->to, a->from), e = vec2_sub(b->to, b->from);
	double t = vec2_cross(vec2_sub(b->from, a->from), e) / vec2_cross(d, e);
	return vec2_mix(a->from, a->to, t);
}

/* `edge_crossed`: GARMENT_NONE where the other half has been asked already. */
static enum tw_status check_half(struct checker *checker, const struct tree_check *check, const struct half_chord *half,
				 uint32_t edge_crossed)
{
	uint32_t other = check->in_face[half->laid.face];
	uint32_t along = edge_crossed == GARMENT_NONE ? GARMENT_NONE : check->branch_on[edge_crossed];
	struct violation violation = {
		RULE_TREE_CROSSING, half->branch, GARMENT_NONE, half->laid.piece, half->laid.to, 0, 0};
	if (other != GARMENT_NONE) {
		violation.other = check->half[other].branch;
		violation.at = meet(&check->half[other].laid, &half->laid);
		return add(checker, &violation);
	}
	if (along == GARMENT_NONE)
		return TW_OK;
	violation.other = along;
	return add(checker, &violation);
}

static enum tw_status check_branch(struct checker *checker, struct tree_check *check, const struct branch *branch,
				   uint32_t index)
{
	enum tw_status status = TW_OK;
	for (uint32_t i = 0; i < branch->edge_count && status == TW_OK; i++) {
		bool first = is_crossing_node(check->network, branch->node[i]);
		if (!first && !is_crossing_node(check->network, branch->node[i + 1]))
			continue;
		struct laid_edge laid[2];
		struct half_chord *half = &check->half[check->half_count];
		network_lay(check->network, branch->edge[i], branch->node[i + first], laid);
		*half = (struct half_chord){index, laid[0]};
		uint32_t crossed = first ? GARMENT_NONE : network_site(check->network, branch->node[i + 1])->edge;
		status = check_half(checker, check, half, crossed);
		check->in_face[laid[0].face] = check->half_count++;
	}
	return status;
}

enum tw_status rules_check_tree(struct violation_list *list, struct arena *arena, const struct network *network,
				const struct branch_set *branches, struct tw_error *error)
{
	struct checker checker = {NULL, list, arena, error};
	const uint32_t faces = network->garment->face_count, edges = network->topology->edge_count;
	if (network->crossing_count == 0)
		return TW_OK;
	struct tree_check check = {
		.network = network,
		.half = ARENA_ARRAY(arena, 2 * (size_t)network->crossing_count, struct half_chord),
		.in_face = ARENA_ARRAY(arena, faces, uint32_t),
		.branch_on = ARENA_ARRAY(arena, edges, uint32_t),
	};
	if (!check.half || !check.in_face || !check.branch_on)
		return tw_fail_memory(error);
	memset(check.in_face, 0xff, faces * sizeof *check.in_face);
	memset(check.branch_on, 0xff, edges * sizeof *check.branch_on);
	for (uint32_t b = 0; b < branches->branch_count; b++)
		for (uint32_t i = 0; i < branches->branch[b].edge_count; i++)
			if (branches->branch[b].edge[i] < network->mesh_edge_count)
				check.branch_on[network->mesh_edge[branches->branch[b].edge[i]]] = b;
	enum tw_status status = TW_OK;
	for (uint32_t b = 0; b < branches->branch_count && status == TW_OK; b++)
		status = check_branch(&checker, &check, &branches->branch[b], b);
	return status;
}

enum tw_status rules_check(struct violation_list *list, struct arena *arena, const struct rules_input *input,
			   struct tw_error *error)
{
	struct checker checker = {input, list, arena, error};
	*list = (struct violation_list){0};
	enum tw_status status = check_spans(&checker, check_radius);
	if (status == TW_OK)
		status = check_spans(&checker, check_piece);
	if (status == TW_OK)
		status = check_keep_outs(&checker);
	if (status == TW_OK)
		status = check_tolerance(&checker);
	if (status == TW_OK)
		status = check_overlaps(&checker);
	if (status == TW_OK)
		status = check_corners(&checker);
	if (status == TW_OK)
		status = rules_check_tree(list, arena, input->network, input->branches, error);
	return status;
}
