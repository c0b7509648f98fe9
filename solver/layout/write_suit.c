/* suit.svg: the worn suit from the front and from behind, with its seams, the wires in their strips, the baseline's
 * wires as dashed lines, and the terminals. One unit is one millimetre on the wearer. The cloth is drawn as rows of
 * equal shade, a path for each shade, so the size of the file does not depend on the mesh. */
#include "solver/layout/result.h"
#include "solver/pattern/label.h"
#include "solver/pattern/view.h"

enum { MARGIN_MM = 60, GAP_MM = 80, NAMES_MAX = 40, NAME_MM = 26, DOT_MM = 9 };
static const double cell_mm = 2.5;
static const double run_mm = 30;   /* what is seen, or not seen, for less is not drawn so */
static const double slack_mm = 18; /* cloth this little before a wire does not hide it: less than a limb is thick */

struct drawing {
	const struct layout_result *result;
	struct text *text;
	struct arena *arena;
	struct view view[2];
	double shift[2]; /* of a view's left edge on the page */
	double top;      /* of both */
};

static struct vec2 on_page(const struct drawing *drawing, int side, const double point[3])
{
	double depth;
	struct vec2 p = view_point(&drawing->view[side], point, &depth);
	return (struct vec2){p.x - drawing->view[side].left + drawing->shift[side], drawing->top - p.y};
}

static void add_xy(struct text *text, struct vec2 p)
{
	text_number(text, p.x, 1);
	text_add(text, " ");
	text_number(text, p.y, 1);
}

/* All rows of one shade, each run from where the last one ended. */
static void add_shade(const struct drawing *drawing, int side, int shade)
{
	const struct view *view = &drawing->view[side];
	long at_x = 0, at_y = 0;
	for (uint32_t row = 0; row < view->rows; row++) {
		const uint8_t *line = &view->shade[(size_t)row * view->columns];
		for (uint32_t column = 0; column < view->columns;) {
			uint32_t end = column;
			while (end < view->columns && line[end] == shade)
				end++;
			if (end == column) {
				column++;
				continue;
			}
			text_format(drawing->text, "m%ld %ldh%u", (long)column - at_x, (long)row - at_y, end - column);
			at_x = end;
			at_y = row;
			column = end;
		}
	}
}

static void add_cloth(const struct drawing *drawing, int side)
{
	const struct view *view = &drawing->view[side];
	text_add(drawing->text, "<g transform=\"translate(");
	text_number(drawing->text, drawing->shift[side], 2);
	text_add(drawing->text, " ");
	text_number(drawing->text, drawing->top - view->top, 2);
	text_add(drawing->text, ") scale(");
	text_number(drawing->text, view->cell_mm, 4);
	text_add(drawing->text, ") translate(0 .5)\" fill=\"none\" stroke-width=\"1.08\">\n");
	for (int shade = 1; shade <= VIEW_SHADES; shade++) {
		int grey = 96 + (150 * (shade - 1)) / (VIEW_SHADES - 1);
		text_format(drawing->text, "<path stroke=\"#%02x%02x%02x\" d=\"M0 0", (unsigned)grey,
			    (unsigned)grey + 3, (unsigned)grey + 8);
		add_shade(drawing, side, shade);
		text_add(drawing->text, "\"/>\n");
	}
	text_add(drawing->text, "</g>\n");
}

static void add_seams(const struct drawing *drawing, int side)
{
	const struct garment *garment = drawing->result->input->garment;
	const struct topology *topology = drawing->result->input->topology;
	text_add(drawing->text, "<path fill=\"none\" stroke=\"#3d5a80\" stroke-width=\"1.6\" d=\"");
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		const double *a = &garment->position[3 * (size_t)topology->edge_vertex[2 * (size_t)e]];
		const double *b = &garment->position[3 * (size_t)topology->edge_vertex[2 * (size_t)e + 1]];
		const double middle[3] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
		if (topology->edge_kind[e] == EDGE_INNER || !view_sees(&drawing->view[side], middle, slack_mm))
			continue;
		text_add(drawing->text, "M");
		add_xy(drawing->text, on_page(drawing, side, a));
		text_add(drawing->text, "L");
		add_xy(drawing->text, on_page(drawing, side, b));
	}
	text_add(drawing->text, "\"/>\n");
}

/* The points of one branch as a side shows them. */
struct seen_line {
	struct vec2 *at;
	bool *seen;
	uint32_t count;
};

static bool find_line(const struct drawing *drawing, int side, const struct trace *trace, uint32_t branch,
		      struct seen_line *line)
{
	uint32_t first = trace->first[branch];
	line->count = trace->first[branch + 1] - first;
	line->at = ARENA_ARRAY(drawing->arena, line->count, struct vec2);
	line->seen = ARENA_ARRAY(drawing->arena, line->count, bool);
	if (!line->at || !line->seen)
		return false;
	for (uint32_t i = 0; i < line->count; i++) {
		double point[3];
		place_on_worn(drawing->result->input->garment, &trace->place[first + i], point);
		line->at[i] = on_page(drawing, side, point);
		line->seen[i] = view_sees(&drawing->view[side], point, slack_mm);
	}
	return true;
}

/* Makes runs of `what` that are short the opposite. Those at the branch's ends stay where they are hidden: a wire goes
 * on behind the limb there. */
static void drop_short_runs(const struct seen_line *line, bool what)
{
	for (uint32_t i = 0, end; i < line->count; i = end) {
		double length = 0;
		for (end = i + 1; end < line->count && line->seen[end] == line->seen[i]; end++)
			length += vec2_distance(line->at[end - 1], line->at[end]);
		bool inside = i > 0 && end < line->count;
		if (line->seen[i] == what && length < run_mm && (inside || (what && end - i < line->count)))
			for (uint32_t k = i; k < end; k++)
				line->seen[k] = !what;
	}
}

static void add_line(const struct drawing *drawing, const struct seen_line *line)
{
	bool pen_down = false;
	struct vec2 last = {0, 0};
	for (uint32_t i = 0; i < line->count; i++) {
		struct vec2 p = line->at[i];
		/* Half a millimetre is finer than the picture: nearer points are left out. */
		if (line->seen[i] && pen_down && i + 1 < line->count && vec2_distance(p, last) < 0.5)
			continue;
		if (line->seen[i]) {
			text_add(drawing->text, pen_down ? "L" : "M");
			add_xy(drawing->text, p);
			last = p;
		}
		pen_down = line->seen[i];
	}
}

/* What is seen of the branches, as one path. A wire that runs along the outline of a limb comes and goes with every
 * face: what flickers is drawn through, or not at all. */
static void add_wire_paths(const struct drawing *drawing, int side, const struct solved *solved)
{
	for (uint32_t b = 0; b < solved->branches.branch_count; b++) {
		struct arena_mark mark = arena_mark(drawing->arena);
		struct seen_line line;
		if (find_line(drawing, side, &solved->trace, b, &line)) {
			drop_short_runs(&line, false);
			drop_short_runs(&line, true);
			add_line(drawing, &line);
		} else {
			drawing->text->failed = true;
		}
		arena_release(drawing->arena, mark);
	}
}

static void add_wires(const struct drawing *drawing, int side, const struct solved *solved, const char *attributes)
{
	text_format(drawing->text, "<path fill=\"none\" stroke-linejoin=\"round\" %s d=\"", attributes);
	add_wire_paths(drawing, side, solved);
	text_add(drawing->text, "\"/>\n");
}

/* Where a terminal is on the page; false where it is not seen from this side. */
static bool find_terminal(const struct drawing *drawing, int side, uint32_t site, struct vec2 *at)
{
	double point[3];
	place_on_worn(drawing->result->input->garment, &drawing->result->sites->site[site].place, point);
	*at = on_page(drawing, side, point);
	return view_sees(&drawing->view[side], point, slack_mm);
}

static const char *name_of(const struct drawing *drawing, uint32_t site, char *buffer)
{
	return terminal_name(drawing->result->input->request, drawing->result->sites->site[site].terminal, buffer);
}

static void add_dots(const struct drawing *drawing, int side)
{
	for (uint32_t s = 0; s < drawing->result->sites->count; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(drawing, side, s, &p))
			continue;
		text_format(drawing->text, "<circle r=\"%d\" cx=\"", DOT_MM);
		text_number(drawing->text, p.x, 1);
		text_add(drawing->text, "\" cy=\"");
		text_number(drawing->text, p.y, 1);
		text_add(drawing->text, "\"><title>");
		text_xml(drawing->text, name_of(drawing, s, buffer));
		text_add(drawing->text, "</title></circle>\n");
	}
}

/* Wires and dots are what names keep off, before all else the names of others. */
static enum tw_status place_names(const struct drawing *drawing, int side, struct label_page *page)
{
	const struct layout_result *result = drawing->result;
	const struct trace *trace = &result->ours->trace;
	uint32_t points = trace->first[result->ours->branches.branch_count], names = result->sites->count;
	double strip = result->field->options.strip_width_mm;
	double width = drawing->view[side].columns * drawing->view[side].cell_mm;
	double height = drawing->view[side].rows * drawing->view[side].cell_mm;
	double room = GAP_MM / 2.0;
	struct label_box bounds = {drawing->shift[side] - room, MARGIN_MM - room, drawing->shift[side] + width + room,
				   MARGIN_MM + height + room};
	enum tw_status status = label_page_init(page, drawing->arena, bounds, DOT_MM + 4, names, names + points, NULL);
	if (status)
		return status;
	for (uint32_t s = 0; s < names; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(drawing, side, s, &p))
			continue;
		label_page_add(page, p, name_of(drawing, s, buffer), NAME_MM);
		label_page_block(page, p, 2 * DOT_MM, LABEL_PRICE);
	}
	for (uint32_t i = 0; i < points; i++) {
		double point[3];
		place_on_worn(result->input->garment, &trace->place[i], point);
		if (view_sees(&drawing->view[side], point, slack_mm))
			label_page_block(page, on_page(drawing, side, point), strip, 0.2);
	}
	label_page_settle(page);
	return TW_OK;
}

static void add_names(const struct drawing *drawing, int side)
{
	struct label_page page;
	uint32_t next = 0;
	if (drawing->result->sites->count > NAMES_MAX)
		return;
	if (place_names(drawing, side, &page)) {
		drawing->text->failed = true;
		return;
	}
	for (uint32_t s = 0; s < drawing->result->sites->count; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(drawing, side, s, &p))
			continue;
		const struct label *label = &page.label[next++];
		text_format(drawing->text, "<text text-anchor=\"%s\" x=\"", label_anchor_name(label->anchor));
		text_number(drawing->text, label->text.x, 1);
		text_add(drawing->text, "\" y=\"");
		text_number(drawing->text, label->text.y, 1);
		text_add(drawing->text, "\">");
		text_xml(drawing->text, name_of(drawing, s, buffer));
		text_add(drawing->text, "</text>\n");
	}
}

static void add_side(const struct drawing *drawing, int side)
{
	const struct layout_result *result = drawing->result;
	struct text *text = drawing->text;
	text_format(text, "<g id=\"%s\">\n", side ? "back" : "front");
	add_cloth(drawing, side);
	add_seams(drawing, side);
	if (result->baseline)
		add_wires(drawing, side, result->baseline,
			  "stroke=\"#444\" stroke-width=\"3\" stroke-dasharray=\"12 8\"");
	char strip[96];
	snprintf(strip, sizeof strip, "stroke=\"#f0a030\" stroke-opacity=\"0.75\" stroke-width=\"%g\"",
		 result->field->options.strip_width_mm);
	add_wires(drawing, side, result->ours, strip);
	add_wires(drawing, side, result->ours, "stroke=\"#b3261e\" stroke-width=\"3.5\"");
	text_format(text,
		    "<g fill=\"#14532d\" stroke=\"#fff\" stroke-width=\"4\" paint-order=\"stroke\" font-size=\"%d\">\n",
		    NAME_MM);
	add_dots(drawing, side);
	add_names(drawing, side);
	text_add(text, "</g>\n</g>\n");
}

static void add_caption(const struct drawing *drawing, double height)
{
	const struct layout_result *result = drawing->result;
	struct text *text = drawing->text;
	text_add(text, "<g font-size=\"30\" fill=\"#333\">\n<text x=\"60\" y=\"");
	text_number(text, height - 30, 1);
	bool optimal = result->ours->tree.outcome == STEINER_OPTIMAL;
	text_add(text, optimal ? "\">provably optimal tree, energy " : "\">best tree found, energy ");
	text_number(text, result->ours->metrics.total.energy, 0);
	text_add(text, " MPa·mm²");
	double baseline = result->baseline ? result->baseline->metrics.total.energy : 0;
	if (baseline > 0) {
		double saved = 100 * (1 - result->ours->metrics.total.energy / baseline);
		bool shortest = result->input->request->options.baseline == BASELINE_LENGTH;
		text_format(text, " (%.1f %% %s than the dashed tree of %s)", fabs(saved), saved < 0 ? "more" : "less",
			    shortest ? "least length" : "fewest edges");
	}
	text_add(text, "</text>\n</g>\n");
}

void write_suit_svg(const struct layout_result *result, struct text *text)
{
	struct arena *arena = arena_new(0);
	struct drawing drawing = {.result = result, .text = text, .arena = arena};
	double right = MARGIN_MM, height = 0;
	for (int side = 0; side < 2; side++) {
		struct view *view = &drawing.view[side];
		if (!arena || view_render(view, arena, result->input->garment, side == 1, cell_mm, NULL)) {
			text->failed = true;
			arena_free(arena);
			return;
		}
		drawing.shift[side] = right;
		right += view->columns * view->cell_mm + (side ? MARGIN_MM : GAP_MM);
		height = view->rows * view->cell_mm;
	}
	drawing.top = drawing.view[0].top + MARGIN_MM;
	height += 2 * MARGIN_MM + 40;
	text_add(
		text,
		"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ");
	text_number(text, right, 1);
	text_add(text, " ");
	text_number(text, height, 1);
	text_add(text,
		 "\" font-family=\"sans-serif\">\n<title>tightwire layout on the worn suit, front and back</title>\n"
		 "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
	add_side(&drawing, 0);
	add_side(&drawing, 1);
	add_caption(&drawing, height);
	text_add(text, "</svg>\n");
	arena_free(arena);
}
