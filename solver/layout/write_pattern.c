/* The pattern at true scale, one layer for each meaning, so that a cutting room can switch off what it does not need:
 *
 *   fabric   the pieces' faces           cut-line  their outlines, hems and seams alike
 *   keep-outs  where the request allows no strip
 *   seams    what is sewn to what: equal numbers belong together, a tick marks the middle of a seam
 *   notches  where a wire passes a seam, on both pieces
 *   strips   the strips that carry the wires, in their width, cut at the cut lines      wires  their centre lines
 *   terminals, junctions, violations, pieces (names and grain lines), scale */
#include "solver/drawing/svg.h"
#include "solver/layout/sheet_faces.h"
#include "solver/layout/sheet_names.h"

enum { NOTCH_MM = 4 };
static const double terminal_mm = 3, junction_mm = 1.6, violation_mm = 8; /* radii */

static const struct drawing_style fabric_style = {.name = "fabric", .fill = "#f4f1ea"};
static const struct drawing_style keep_out_style = {.name = "keep-out", .fill = "#c9bfae"};
static const struct drawing_style strip_style = {.name = "strip", .fill = "#e8a33d", .opacity = 0.55};
static const struct drawing_style cut_style = {.name = "cut", .stroke = "#000000", .stroke_mm = 0.6};
static const struct drawing_style seam_style = {.name = "seam", .stroke = "#1f6fb2", .stroke_mm = 1, .dash_mm = {6, 3}};
static const struct drawing_style notch_style = {.name = "notch", .stroke = "#000000", .stroke_mm = 1.2};
static const struct drawing_style wire_style = {.name = "wire", .stroke = "#b3261e", .stroke_mm = 1.2};
static const struct drawing_style junction_style = {.name = "junction", .fill = "#b3261e"};
static const struct drawing_style terminal_style = {.name = "terminal", .fill = "#14532d"};
static const struct drawing_style violation_style = {.name = "violation", .stroke = "#c2185b", .stroke_mm = 1.5};
static const struct drawing_style scale_style = {.name = "scale", .stroke = "#333333", .stroke_mm = 0.5};
static const struct drawing_style caption_style = {.name = "caption", .fill = "#333333"};

static void add_loop(const struct sheet *sheet, struct drawing_item *path, const struct outline_loop *loop)
{
	for (uint32_t i = 0; i < loop->count; i++) {
		struct vec2 from, to;
		outline_ends(sheet->result->outline, sheet->result->input->garment, loop->first + i, &from, &to);
		from = sheet_point(sheet, loop->piece, from);
		if (i == 0)
			drawing_move_to(sheet->drawing, path, from);
		else
			drawing_line_to(sheet->drawing, path, from);
	}
}

/* All loops of a piece are one path: holes are holes. */
static void add_outlines(const struct sheet *sheet, const struct drawing_style *style)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t l = 0; l < outline->loop_count;) {
		uint32_t piece = outline->loop[l].piece;
		struct drawing_item *path = drawing_add_path(sheet->drawing, style, piece, true);
		drawing_set_title(path, sheet->result->input->garment->piece_name[piece]);
		for (; l < outline->loop_count && outline->loop[l].piece == piece; l++)
			add_loop(sheet, path, &outline->loop[l]);
	}
}

/* The segments of one seam side are neighbours in their loop, but for the loop's end. */
static void add_seam_lines(const struct sheet *sheet)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t l = 0; l < outline->loop_count; l++) {
		const struct outline_loop *loop = &outline->loop[l];
		struct drawing_item *path = NULL;
		uint32_t seam = GARMENT_NONE;
		for (uint32_t i = loop->first; i < loop->first + loop->count; i++) {
			const struct outline_segment *segment = &outline->segment[i];
			struct vec2 from, to;
			outline_ends(outline, sheet->result->input->garment, i, &from, &to);
			if (segment->seam != GARMENT_NONE && segment->seam != seam) {
				path = drawing_add_path(sheet->drawing, &seam_style, loop->piece, false);
				drawing_move_to(sheet->drawing, path, sheet_point(sheet, loop->piece, from));
			}
			seam = segment->seam;
			if (seam != GARMENT_NONE)
				drawing_line_to(sheet->drawing, path, sheet_point(sheet, loop->piece, to));
		}
	}
}

/* A short line across the cut line, inwards. */
static void add_notch(const struct sheet *sheet, uint32_t piece, struct vec2 at, struct vec2 inward)
{
	drawing_add_line(sheet->drawing, &notch_style, piece, sheet_point(sheet, piece, at),
			 sheet_point(sheet, piece, vec2_along(at, inward, NOTCH_MM)));
}

static void add_notches(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++) {
		const struct wire *wire = &ours->wires.wire[b];
		for (uint32_t s = 1; s < wire->span_count; s++) {
			const struct span *in = &wire->span[s - 1], *out = &wire->span[s];
			if (wire_goes_on(out))
				continue;
			add_notch(sheet, in->piece, in->to, vec2_scale(span_direction(in, 1), -1));
			add_notch(sheet, out->piece, out->from, span_direction(out, 0));
		}
	}
}

static void add_span(const struct sheet *sheet, struct drawing_item *path, const struct span *span)
{
	struct vec2 to = sheet_point(sheet, span->piece, span->to);
	if (span_is_arc(span))
		drawing_arc_to(sheet->drawing, path, to, span->turn);
	else
		drawing_line_to(sheet->drawing, path, to);
}

/* A path for every stretch of a branch in one piece. */
static void add_wires(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++) {
		const struct wire *wire = &ours->wires.wire[b];
		struct drawing_item *path = NULL;
		for (uint32_t s = 0; s < wire->span_count; s++) {
			const struct span *span = &wire->span[s];
			if (s == 0 || !wire_goes_on(span)) {
				path = drawing_add_path(sheet->drawing, &wire_style, span->piece, false);
				drawing_move_to(sheet->drawing, path, sheet_point(sheet, span->piece, span->from));
			}
			add_span(sheet, path, span);
		}
	}
}

static void add_strip(const struct sheet *sheet, const struct strip_area *area)
{
	const struct region *region = &area->region;
	struct drawing_item *path = drawing_add_path(sheet->drawing, &strip_style, area->piece, true);
	for (uint32_t l = 0; l < region->loop_count; l++)
		for (uint32_t i = region->first[l]; i < region->first[l + 1]; i++) {
			struct vec2 at = sheet_point(sheet, area->piece, region->point[i]);
			if (i == region->first[l])
				drawing_move_to(sheet->drawing, path, at);
			else
				drawing_line_to(sheet->drawing, path, at);
		}
}

static void add_strips(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++)
		for (uint32_t i = 0; i < ours->strips[b].count; i++)
			add_strip(sheet, &ours->strips[b].area[i]);
}

static struct drawing_item *add_circle(const struct sheet *sheet, const struct drawing_style *style, uint32_t piece,
				       struct vec2 at, double radius)
{
	return drawing_add_circle(sheet->drawing, style, piece, sheet_point(sheet, piece, at), radius);
}

static void add_terminals(const struct sheet *sheet)
{
	const struct site_set *sites = sheet->result->sites;
	for (uint32_t s = 0; s < sites->count; s++)
		for (uint32_t m = 0; m < sites->site[s].mark_count; m++)
			add_circle(sheet, &terminal_style, sites->site[s].mark[m].piece, sites->site[s].mark[m].at,
				   terminal_mm);
}

static void add_junctions(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t e = sheet->result->sites->count; e < ours->branches.end_count; e++)
		add_circle(sheet, &junction_style, ours->wires.end[e].piece, ours->wires.end[e].at, junction_mm);
}

/* A square to measure after printing, its lower edge a ruler. */
static void add_check_square(const struct sheet *sheet, struct vec2 low)
{
	enum { SIDE_MM = 100, STEP_MM = 10 };
	struct drawing *drawing = sheet->drawing;
	struct drawing_item *path = drawing_add_path(drawing, &scale_style, DRAWING_NONE, true);
	drawing_move_to(drawing, path, low);
	drawing_line_to(drawing, path, (struct vec2){low.x + SIDE_MM, low.y});
	drawing_line_to(drawing, path, (struct vec2){low.x + SIDE_MM, low.y + SIDE_MM});
	drawing_line_to(drawing, path, (struct vec2){low.x, low.y + SIDE_MM});
	for (int i = 1; i < SIDE_MM / STEP_MM; i++) {
		struct vec2 at = {low.x + i * STEP_MM, low.y};
		drawing_add_line(drawing, &scale_style, DRAWING_NONE, at,
				 (struct vec2){at.x, at.y + (2 * i * STEP_MM == SIDE_MM ? 6 : 3)});
	}
}

static void add_caption(const struct sheet *sheet, struct vec2 at, double size, enum drawing_anchor anchor,
			const char *text)
{
	const struct drawing_text caption = {.at = at, .size_mm = size, .anchor = anchor, .text = text};
	drawing_add_text(sheet->drawing, &caption_style, DRAWING_NONE, &caption);
}

/* A number with at most two decimals, whatever the locale. */
static const char *short_number(const struct sheet *sheet, double value)
{
	long hundredths = (long)floor(100 * value + 0.5);
	long whole = hundredths / 100, rest = hundredths % 100;
	if (rest == 0)
		return drawing_format(sheet->drawing, "%ld", whole);
	return rest % 10 ? drawing_format(sheet->drawing, "%ld.%02ld", whole, rest)
			 : drawing_format(sheet->drawing, "%ld.%ld", whole, rest / 10);
}

/* A ring around each place, which names the rule, the branch and by how much. */
static void add_violations(const struct sheet *sheet)
{
	const struct violation_list *list = &sheet->result->ours->violations;
	for (uint32_t i = 0; i < list->count; i++) {
		const struct violation *broken = &list->violation[i];
		const char *unit = rule_unit(broken->rule);
		struct drawing_item *ring =
			add_circle(sheet, &violation_style, broken->piece, broken->at, violation_mm);
		drawing_set_title(ring, drawing_format(sheet->drawing, "%s: branch %u, %s %s, limit %s %s",
						       rule_name(broken->rule), broken->branch,
						       short_number(sheet, broken->value), unit,
						       short_number(sheet, broken->limit), unit));
	}
}

static void add_scale(const struct sheet *sheet)
{
	const struct layout_result *result = sheet->result;
	double top = sheet->height;
	add_check_square(sheet, (struct vec2){30, top - 130});
	add_caption(sheet, (struct vec2){80, top - 76}, 9, DRAWING_MIDDLE, "100 × 100 mm");
	add_caption(sheet, (struct vec2){80, top - 92}, 9, DRAWING_MIDDLE, "print at 100 %");
	add_caption(sheet, (struct vec2){150, top - 48}, 20, DRAWING_START,
		    drawing_format(sheet->drawing, "tightwire layout: %u terminals, %u branches, %.0f mm of wire",
				   result->sites->count, result->ours->branches.branch_count,
				   result->ours->metrics.total.length_mm));
	add_caption(sheet, (struct vec2){150, top - 70}, 12, DRAWING_START,
		    drawing_format(sheet->drawing,
				   "strip %s mm wide, smallest radius %s mm; equal numbers on cut lines are sewn "
				   "together; grain along the arrows",
				   short_number(sheet, result->field->options.strip_width_mm),
				   short_number(sheet, result->rules->minimum_radius_mm)));
	if (result->ours->violations.count > 0)
		add_caption(sheet, (struct vec2){150, top - 88}, 12, DRAWING_START,
			    drawing_format(sheet->drawing, "circled: broken rules, %u; layout.json names them",
					   result->ours->violations.count));
}

static void fill(const struct sheet *sheet, const struct sheet_names *names)
{
	struct drawing *drawing = sheet->drawing;
	drawing_begin_layer(drawing, "fabric", "fabric");
	add_outlines(sheet, &fabric_style);
	if (sheet->result->rules->face_keep_out) {
		drawing_begin_layer(drawing, "keep-outs", "kept out");
		if (sheet_add_faces(sheet, &keep_out_style, sheet->result->rules->face_keep_out) != TW_OK)
			drawing->failed = true;
	}
	drawing_begin_layer(drawing, "strips", "wire strips");
	add_strips(sheet);
	drawing_begin_layer(drawing, "cut-line", "cut line");
	add_outlines(sheet, &cut_style);
	drawing_begin_layer(drawing, "seams", "seams");
	add_seam_lines(sheet);
	sheet_names_add_seams(names, sheet);
	drawing_begin_layer(drawing, "notches", "wire notches");
	add_notches(sheet);
	drawing_begin_layer(drawing, "wires", "wire centre lines");
	add_wires(sheet);
	drawing_begin_layer(drawing, "junctions", "junctions");
	add_junctions(sheet);
	drawing_begin_layer(drawing, "terminals", "terminals");
	add_terminals(sheet);
	sheet_names_add_terminals(names, sheet);
	drawing_begin_layer(drawing, "violations", "design-rule violations");
	add_violations(sheet);
	drawing_begin_layer(drawing, "pieces", "piece names and grain");
	sheet_names_add_pieces(names, sheet);
	drawing_begin_layer(drawing, "scale", "scale");
	add_scale(sheet);
}

void pattern_draw(const struct layout_result *result, struct drawing *drawing, struct arena *arena)
{
	*drawing = (struct drawing){.arena = arena,
				    .title = "tightwire pattern, millimetres, true scale",
				    .true_scale = true,
				    .decimals = 3};
	struct sheet sheet = {.result = result, .drawing = drawing, .arena = arena};
	struct sheet_names names;
	if (sheet_arrange(&sheet) != TW_OK || sheet_names_find(&names, &sheet) != TW_OK)
		drawing->failed = true;
	else
		fill(&sheet, &names);
}
