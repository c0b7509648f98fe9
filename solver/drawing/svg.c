/* Items of one style that follow each other share a group. The page's y axis points up and SVG's down: y is turned at
 * the last moment, and with it the way an arc sweeps. */
#include "solver/drawing/svg.h"

#include <string.h>

struct writer {
	const struct drawing *drawing;
	struct text *text;
};

static void add_number(const struct writer *writer, double value)
{
	text_number(writer->text, value, writer->drawing->decimals);
}

static void add_attribute(const struct writer *writer, const char *name, double value)
{
	text_format(writer->text, " %s=\"", name);
	add_number(writer, value);
	text_add(writer->text, "\"");
}

static void add_point(const struct writer *writer, struct vec2 at)
{
	add_number(writer, at.x);
	text_add(writer->text, " ");
	add_number(writer, writer->drawing->height - at.y);
}

static void add_place(const struct writer *writer, const char *x, const char *y, struct vec2 at)
{
	add_attribute(writer, x, at.x);
	add_attribute(writer, y, writer->drawing->height - at.y);
}

/* The radius of an arc over a chord: of the half chord h and the sagitta s = h * bulge it is (h² + s²) / 2s. Given with
 * more digits than the ends, which are rounded: a reader puts the arc through them anyway. */
static void add_arc(const struct writer *writer, const struct drawing_vertex *from, struct vec2 to)
{
	double bulge = fabs(from->bulge), radius = vec2_distance(from->at, to) / 4 * (1 + bulge * bulge) / bulge;
	text_add(writer->text, "A");
	text_number(writer->text, radius, 4);
	text_add(writer->text, " ");
	text_number(writer->text, radius, 4);
	text_format(writer->text, " 0 %d %d ", bulge > 1, from->bulge < 0);
}

static void add_path_data(const struct writer *writer, const struct drawing_path *path)
{
	for (uint32_t i = 0; i < path->count; i++) {
		const struct drawing_vertex *vertex = &path->vertex[i];
		if (vertex->begins && i && path->closed)
			text_add(writer->text, "Z");
		if (vertex->begins)
			text_add(writer->text, "M");
		else if (vertex[-1].bulge != 0)
			add_arc(writer, &vertex[-1], vertex->at);
		else
			text_add(writer->text, "L");
		add_point(writer, vertex->at);
	}
	if (path->closed)
		text_add(writer->text, "Z");
}

static void close_item(const struct writer *writer, const char *element, const char *title)
{
	if (!title) {
		text_add(writer->text, "/>\n");
		return;
	}
	text_add(writer->text, "><title>");
	text_xml(writer->text, title);
	text_format(writer->text, "</title></%s>\n", element);
}

static void add_path(const struct writer *writer, const struct drawing_item *item)
{
	if (!item->path.count)
		return;
	text_add(writer->text, "<path d=\"");
	add_path_data(writer, &item->path);
	text_add(writer->text, "\"");
	close_item(writer, "path", item->title);
}

static void add_circle(const struct writer *writer, const struct drawing_item *item)
{
	text_add(writer->text, "<circle");
	add_place(writer, "cx", "cy", item->circle.centre);
	add_attribute(writer, "r", item->circle.radius);
	close_item(writer, "circle", item->title);
}

static void add_text(const struct writer *writer, const struct drawing_item *item)
{
	static const char *const anchors[] = {[DRAWING_START] = "",
					      [DRAWING_MIDDLE] = " text-anchor=\"middle\"",
					      [DRAWING_END] = " text-anchor=\"end\""};
	text_add(writer->text, "<text");
	add_place(writer, "x", "y", item->text.at);
	add_attribute(writer, "font-size", item->text.size_mm);
	text_format(writer->text, "%s>", anchors[item->text.anchor]);
	text_xml(writer->text, item->text.text);
	text_add(writer->text, "</text>\n");
}

/* All rows of one shade, each run from where the last one ended. */
static void add_shade(const struct writer *writer, const struct drawing_cells *cells, uint32_t shade)
{
	struct text *text = writer->text;
	long at_x = 0, at_y = 0;
	for (uint32_t row = 0; row < cells->rows; row++) {
		const uint8_t *line = &cells->shade[(size_t)row * cells->columns], *end = line + cells->columns;
		for (const uint8_t *from = line; (from = memchr(from, (int)shade, (size_t)(end - from)));) {
			const uint8_t *to = from;
			while (to < end && *to == shade)
				to++;
			text_add(text, "m");
			text_integer(text, (from - line) - at_x);
			text_add(text, " ");
			text_integer(text, (long)row - at_y);
			text_add(text, "h");
			text_integer(text, to - from);
			at_x = to - line;
			at_y = row;
			from = to;
		}
	}
}

/* A path for each shade, a line as wide as a row for each run of cells: the strokes overlap a little, so that no gaps
 * shine through. */
static void add_cells(const struct writer *writer, const struct drawing_cells *cells)
{
	text_add(writer->text, "<g transform=\"translate(");
	add_point(writer, cells->at);
	text_add(writer->text, ") scale(");
	text_number(writer->text, cells->cell_mm, 4);
	text_add(writer->text, ") translate(0 .5)\" fill=\"none\" stroke-width=\"1.08\">\n");
	for (uint32_t shade = 1; shade < cells->shade_count; shade++) {
		text_format(writer->text, "<path stroke=\"%s\" d=\"M0 0", cells->colour[shade]);
		add_shade(writer, cells, shade);
		text_add(writer->text, "\"/>\n");
	}
	text_add(writer->text, "</g>\n");
}

static void add_dashes(const struct writer *writer, const double dash[2])
{
	text_add(writer->text, " stroke-dasharray=\"");
	text_number(writer->text, dash[0], 3);
	text_add(writer->text, " ");
	text_number(writer->text, dash[1], 3);
	text_add(writer->text, "\"");
}

static void open_style(const struct writer *writer, const struct drawing_style *style)
{
	struct text *text = writer->text;
	text_format(text, "<g class=\"%s\" fill=\"%s\"", style->name, style->fill ? style->fill : "none");
	if (style->fill)
		text_add(text, " fill-rule=\"evenodd\"");
	if (style->stroke) {
		text_format(text, " stroke=\"%s\" stroke-linejoin=\"round\" stroke-width=\"", style->stroke);
		text_number(text, style->stroke_mm, 4);
		text_add(text, "\"");
	}
	if (style->opacity > 0 && style->opacity < 1 && style->fill) {
		text_add(text, " fill-opacity=\"");
		text_number(text, style->opacity, 3);
		text_add(text, "\"");
	}
	if (style->opacity > 0 && style->opacity < 1 && style->stroke) {
		text_add(text, " stroke-opacity=\"");
		text_number(text, style->opacity, 3);
		text_add(text, "\"");
	}
	if (style->dash_mm[0] > 0)
		add_dashes(writer, style->dash_mm);
	text_format(text, "%s>\n", style->halo ? " paint-order=\"stroke\"" : "");
}

static void add_item(const struct writer *writer, const struct drawing_item *item)
{
	switch (item->kind) {
	case DRAWING_PATH:
		add_path(writer, item);
		break;
	case DRAWING_CIRCLE:
		add_circle(writer, item);
		break;
	case DRAWING_TEXT:
		add_text(writer, item);
		break;
	case DRAWING_CELLS:
		add_cells(writer, &item->cells);
		break;
	}
}

static void add_layer(const struct writer *writer, const struct drawing_layer *layer)
{
	const struct drawing_style *open = NULL;
	text_format(writer->text, "<g id=\"%s\" inkscape:groupmode=\"layer\" inkscape:label=\"%s\">\n", layer->id,
		    layer->label);
	for (const struct drawing_item *item = layer->first; item; item = item->next) {
		if (open && item->style != open)
			text_add(writer->text, "</g>\n");
		if (item->style && item->style != open)
			open_style(writer, item->style);
		open = item->style;
		add_item(writer, item);
	}
	text_add(writer->text, open ? "</g>\n</g>\n" : "</g>\n");
}

static void open_page(const struct writer *writer)
{
	const struct drawing *drawing = writer->drawing;
	struct text *text = writer->text;
	text_add(text, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
		       "<svg xmlns=\"http://www.w3.org/2000/svg\" "
		       "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\"");
	if (drawing->true_scale) {
		text_add(text, " width=\"");
		add_number(writer, drawing->width);
		text_add(text, "mm\" height=\"");
		add_number(writer, drawing->height);
		text_add(text, "mm\"");
	}
	text_add(text, " viewBox=\"0 0 ");
	add_number(writer, drawing->width);
	text_add(text, " ");
	add_number(writer, drawing->height);
	text_add(text, "\" font-family=\"sans-serif\">\n<title>");
	text_xml(text, drawing->title);
	text_add(text, "</title>\n<rect id=\"page\" width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
}

void svg_write(const struct drawing *drawing, struct text *text)
{
	const struct writer writer = {drawing, text};
	if (drawing->failed) {
		text->failed = true;
		return;
	}
	open_page(&writer);
	for (const struct drawing_layer *layer = drawing->first; layer; layer = layer->next)
		add_layer(&writer, layer);
	text_add(text, "</svg>\n");
}
