/* The worn suit from the front and from behind, with its seams, the wires in their strips, the baseline's wires as
 * dashed lines, and the terminals. One unit is one millimetre on the wearer. The cloth is a picture of shades, so the
 * size of the file does not depend on the mesh. */
#include "solver/drawing/svg.h"
#include "solver/layout/result.h"
#include "solver/pattern/label.h"
#include "solver/pattern/view.h"

enum { MARGIN_MM = 60, GAP_MM = 80, CAPTION_MM = 40, NAMES_MAX = 40, NAME_MM = 26, DOT_MM = 9, LETTER_MM = 30 };
static const double cell_mm = 2.5;
static const double hidden_mm = 30; /* what is hidden for less, between what is seen, is drawn through */
static const double slack_mm = 18;  /* cloth this little before a wire does not hide it: less than a limb is thick */

static const struct drawing_style seam_style = {.name = "seam", .stroke = "#3d5a80", .stroke_mm = 1.6};
static const struct drawing_style baseline_style = {
	.name = "baseline", .stroke = "#444444", .stroke_mm = 3, .dash_mm = {12, 8}};
static const struct drawing_style wire_style = {.name = "wire", .stroke = "#b3261e", .stroke_mm = 3.5};
static const struct drawing_style terminal_style = {
	.name = "terminal", .fill = "#14532d", .stroke = "#ffffff", .stroke_mm = 4, .halo = true};
static const struct drawing_style caption_style = {.name = "caption", .fill = "#333333"};

struct picture {
	const struct layout_result *result;
	struct drawing *drawing;
	struct arena *arena;
	struct view view[2];
	double shift[2];                  /* of a view's left edge on the page */
	double top;                       /* of both, y up from the lower edge of the page */
	struct drawing_style strip_style; /* as wide as the strips */
	char colour[VIEW_SHADES + 1][8];
};

static struct vec2 on_page(const struct picture *picture, int side, const double point[3])
{
	const struct view *view = &picture->view[side];
	double depth;
	struct vec2 p = view_point(view, point, &depth);
	return (struct vec2){p.x - view->left + picture->shift[side], picture->top + p.y - view->top};
}

static void choose_colours(struct picture *picture)
{
	for (unsigned shade = 1; shade <= VIEW_SHADES; shade++) {
		unsigned grey = 96 + (150 * (shade - 1)) / (VIEW_SHADES - 1);
		snprintf(picture->colour[shade], sizeof picture->colour[shade], "#%02x%02x%02x", grey, grey + 3,
			 grey + 8);
	}
}

static void add_cloth(const struct picture *picture, int side)
{
	const struct view *view = &picture->view[side];
	drawing_add_cells(picture->drawing, &(struct drawing_cells){.at = {picture->shift[side], picture->top},
								    .cell_mm = view->cell_mm,
								    .columns = view->columns,
								    .rows = view->rows,
								    .shade = view->shade,
								    .colour = picture->colour,
								    .shade_count = VIEW_SHADES + 1});
}

static void add_seams(const struct picture *picture, int side)
{
	const struct garment *garment = picture->result->input->garment;
	const struct topology *topology = picture->result->input->topology;
	struct drawing_item *path = drawing_add_path(picture->drawing, &seam_style, DRAWING_NONE, false);
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		const double *a = &garment->position[3 * (size_t)topology->edge_vertex[2 * (size_t)e]];
		const double *b = &garment->position[3 * (size_t)topology->edge_vertex[2 * (size_t)e + 1]];
		const double middle[3] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
		if (topology->edge_kind[e] == EDGE_INNER || !view_sees(&picture->view[side], middle, slack_mm))
			continue;
		drawing_move_to(picture->drawing, path, on_page(picture, side, a));
		drawing_line_to(picture->drawing, path, on_page(picture, side, b));
	}
}

/* The points of one branch as a side shows them. */
struct seen_line {
	struct vec2 *at;
	bool *seen;
	uint32_t count;
};

static bool find_line(const struct picture *picture, int side, const struct trace *trace, uint32_t branch,
		      struct seen_line *line)
{
	uint32_t first = trace->first[branch];
	line->count = trace->first[branch + 1] - first;
	line->at = ARENA_ARRAY(picture->arena, line->count, struct vec2);
	line->seen = ARENA_ARRAY(picture->arena, line->count, bool);
	if (!line->at || !line->seen)
		return false;
	for (uint32_t i = 0; i < line->count; i++) {
		double point[3];
		place_on_worn(picture->result->input->garment, &trace->place[first + i], point);
		line->at[i] = on_page(picture, side, point);
		line->seen[i] = view_sees(&picture->view[side], point, slack_mm);
	}
	return true;
}

/* Shows what is hidden for a short way only: a wire that runs along the outline of a limb comes and goes with every
 * face. At the branch's ends it stays hidden: the wire goes on behind the limb there. */
static void fill_gaps(const struct seen_line *line)
{
	for (uint32_t i = 0, end; i < line->count; i = end) {
		double length = 0;
		for (end = i + 1; end < line->count && line->seen[end] == line->seen[i]; end++)
			length += vec2_distance(line->at[end - 1], line->at[end]);
		if (line->seen[i] || i == 0 || end == line->count || length >= hidden_mm)
			continue;
		for (uint32_t k = i; k < end; k++)
			line->seen[k] = true;
	}
}

/* A point that is seen alone is a line of no length: round ends make a dot of it. */
static void add_line(const struct picture *picture, struct drawing_item *path, const struct seen_line *line)
{
	bool pen_down = false;
	struct vec2 last = {0, 0};
	for (uint32_t i = 0; i < line->count; i++) {
		struct vec2 p = line->at[i];
		/* Half a millimetre is finer than the picture: nearer points are left out. */
		bool goes_on = i + 1 < line->count && line->seen[i + 1];
		if (line->seen[i] && pen_down && goes_on && vec2_distance(p, last) < 0.5)
			continue;
		if (line->seen[i] && pen_down)
			drawing_line_to(picture->drawing, path, p);
		else if (line->seen[i])
			drawing_move_to(picture->drawing, path, p);
		if (line->seen[i])
			last = p;
		pen_down = line->seen[i];
	}
}

/* What is seen of the branches, as one path. */
static void add_wires(const struct picture *picture, int side, const struct solved *solved,
		      const struct drawing_style *style)
{
	struct drawing_item *path = drawing_add_path(picture->drawing, style, DRAWING_NONE, false);
	for (uint32_t b = 0; b < solved->branches.branch_count; b++) {
		struct seen_line line;
		if (!find_line(picture, side, &solved->trace, b, &line)) {
			picture->drawing->failed = true;
			return;
		}
		fill_gaps(&line);
		add_line(picture, path, &line);
	}
}

/* Where a terminal is on the page; false where it is not seen from this side. */
static bool find_terminal(const struct picture *picture, int side, uint32_t site, struct vec2 *at)
{
	double point[3];
	place_on_worn(picture->result->input->garment, &picture->result->sites->site[site].place, point);
	*at = on_page(picture, side, point);
	return view_sees(&picture->view[side], point, slack_mm);
}

static const char *name_of(const struct picture *picture, uint32_t site, char *buffer)
{
	return terminal_name(picture->result->input->request, picture->result->sites->site[site].terminal, buffer);
}

static void add_dots(const struct picture *picture, int side)
{
	for (uint32_t s = 0; s < picture->result->sites->count; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(picture, side, s, &p))
			continue;
		drawing_set_title(drawing_add_circle(picture->drawing, &terminal_style, DRAWING_NONE, p, DOT_MM),
				  drawing_format(picture->drawing, "%s", name_of(picture, s, buffer)));
	}
}

/* From the page's y, up, to that of a label_page, down, and back. */
static struct vec2 flip(const struct picture *picture, struct vec2 page)
{
	return (struct vec2){page.x, picture->drawing->height - page.y};
}

/* Wires and dots are what names keep off, before all else the names of others. */
static enum tw_status place_names(const struct picture *picture, int side, struct label_page *page)
{
	const struct layout_result *result = picture->result;
	const struct trace *trace = &result->ours->trace;
	uint32_t points = trace->first[result->ours->branches.branch_count], names = result->sites->count;
	double strip = result->field->options.strip_width_mm;
	double width = picture->view[side].columns * picture->view[side].cell_mm;
	double height = picture->view[side].rows * picture->view[side].cell_mm;
	double room = GAP_MM / 2.0;
	struct label_box bounds = {picture->shift[side] - room, MARGIN_MM - room, picture->shift[side] + width + room,
				   MARGIN_MM + height + room};
	enum tw_status status = label_page_init(page, picture->arena, bounds, DOT_MM + 4, names, names + points, NULL);
	if (status != TW_OK)
		return status;
	for (uint32_t s = 0; s < names; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(picture, side, s, &p))
			continue;
		label_page_add(page, flip(picture, p), name_of(picture, s, buffer), NAME_MM);
		label_page_block(page, flip(picture, p), 2 * DOT_MM, LABEL_PRICE);
	}
	for (uint32_t i = 0; i < points; i++) {
		double point[3];
		place_on_worn(result->input->garment, &trace->place[i], point);
		if (view_sees(&picture->view[side], point, slack_mm))
			label_page_block(page, flip(picture, on_page(picture, side, point)), strip, 0.2);
	}
	label_page_settle(page);
	return TW_OK;
}

static void add_names(const struct picture *picture, int side)
{
	static const enum drawing_anchor anchors[] = {
		[LABEL_START] = DRAWING_START, [LABEL_MIDDLE] = DRAWING_MIDDLE, [LABEL_END] = DRAWING_END};
	struct label_page page;
	uint32_t next = 0;
	if (picture->result->sites->count > NAMES_MAX)
		return;
	if (place_names(picture, side, &page) != TW_OK) {
		picture->drawing->failed = true;
		return;
	}
	for (uint32_t s = 0; s < picture->result->sites->count; s++) {
		char buffer[16];
		struct vec2 p;
		if (!find_terminal(picture, side, s, &p))
			continue;
		const struct label *label = &page.label[next++];
		const struct drawing_text text = {
			.at = flip(picture, label->text),
			.size_mm = NAME_MM,
			.anchor = anchors[label->anchor],
			.text = drawing_format(picture->drawing, "%s", name_of(picture, s, buffer)),
		};
		drawing_add_text(picture->drawing, &terminal_style, DRAWING_NONE, &text);
	}
}

static void add_side(const struct picture *picture, int side)
{
	const struct layout_result *result = picture->result;
	drawing_begin_layer(picture->drawing, side ? "back" : "front", side ? "back" : "front");
	add_cloth(picture, side);
	add_seams(picture, side);
	if (result->baseline)
		add_wires(picture, side, result->baseline, &baseline_style);
	add_wires(picture, side, result->ours, &picture->strip_style);
	add_wires(picture, side, result->ours, &wire_style);
	add_dots(picture, side);
	add_names(picture, side);
}

/* " (24.8 % less than the dashed tree of fewest edges)", or nothing. */
static const char *comparison(const struct picture *picture)
{
	const struct layout_result *result = picture->result;
	double baseline = result->baseline ? result->baseline->metrics.total.energy : 0;
	if (!(baseline > 0))
		return "";
	double saved = 100 * (1 - result->ours->metrics.total.energy / baseline);
	long tenths = (long)floor(10 * fabs(saved) + 0.5);
	bool shortest = result->input->request->options.baseline == BASELINE_LENGTH;
	return drawing_format(picture->drawing, " (%ld.%ld %% %s than the dashed tree of %s)", tenths / 10, tenths % 10,
			      saved < 0 ? "more" : "less", shortest ? "least length" : "fewest edges");
}

static void add_caption(const struct picture *picture)
{
	const struct layout_result *result = picture->result;
	bool optimal = result->ours->tree.outcome == STEINER_OPTIMAL;
	const char *compared = comparison(picture);
	const struct drawing_text text = {
		.at = {MARGIN_MM, LETTER_MM},
		.size_mm = LETTER_MM,
		.text = compared ? drawing_format(picture->drawing, "%s, energy %.0f MPa·mm²%s",
						  optimal ? "provably optimal tree" : "best tree found",
						  result->ours->metrics.total.energy, compared)
				 : NULL,
	};
	drawing_begin_layer(picture->drawing, "caption", "caption");
	drawing_add_text(picture->drawing, &caption_style, DRAWING_NONE, &text);
}

static bool render(struct picture *picture)
{
	double right = MARGIN_MM, height = 0;
	for (int side = 0; side < 2; side++) {
		struct view *view = &picture->view[side];
		if (view_render(view, picture->arena, picture->result->input->garment, side == 1, cell_mm, NULL) !=
		    TW_OK)
			return false;
		picture->shift[side] = right;
		right += view->columns * view->cell_mm + (side ? MARGIN_MM : GAP_MM);
		height = view->rows * view->cell_mm;
	}
	picture->drawing->width = right;
	picture->drawing->height = height + 2 * MARGIN_MM + CAPTION_MM;
	picture->top = picture->drawing->height - MARGIN_MM;
	return true;
}

void suit_draw(const struct layout_result *result, struct drawing *drawing, struct arena *arena)
{
	*drawing = (struct drawing){
		.arena = arena, .title = "tightwire layout on the worn suit, front and back", .decimals = 1};
	struct picture *picture = ARENA_ZEROED(arena, 1, struct picture);
	if (!picture) {
		drawing->failed = true;
		return;
	}
	picture->result = result;
	picture->drawing = drawing;
	picture->arena = arena;
	picture->strip_style = (struct drawing_style){.name = "strip",
						      .stroke = "#f0a030",
						      .stroke_mm = result->field->options.strip_width_mm,
						      .opacity = 0.75};
	choose_colours(picture);
	if (!render(picture)) {
		drawing->failed = true;
		return;
	}
	add_side(picture, 0);
	add_side(picture, 1);
	add_caption(picture);
}
