/* pattern.svg: the pattern at true scale, one unit of the drawing is one millimetre. A group for each meaning, named as
 * a layer for the programs that know layers (Inkscape), so that a cutting room can switch off what it does not need:
 *
 *   fabric   the pieces' faces           cut-line  their outlines, hems and seams alike
 *   seams    what is sewn to what: equal numbers belong together, a tick marks the middle of a seam
 *   notches  where a wire passes a seam, on both pieces
 *   strips   the strips that carry the wires, in their width, up to the cut lines      wires  their centre lines
 *   terminals, junctions, violations, pieces (names and grain lines), scale
 *
 * The pattern's v axis points up, so v changes its sign on the way to SVG. */
#include "solver/layout/result.h"

#include <stdlib.h>
#include <string.h>

enum { MARGIN_MM = 30, GAP_MM = 30, SHELF_MM = 2000, HEADER_MM = 150 };

struct sheet {
	const struct layout_result *result;
	struct text *text;
	struct vec2 *offset; /* [piece_count] from a piece's plane to the sheet, v still up */
	double left, bottom, right, top;
};

struct extent {
	struct vec2 low, high;
};

static struct extent piece_extent(const struct layout_result *result, uint32_t piece)
{
	struct extent extent = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
	const struct outline *outline = result->outline;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		struct vec2 from, to;
		outline_ends(outline, result->input->garment, i, &from, &to);
		extent.low.x = from.x < extent.low.x ? from.x : extent.low.x;
		extent.low.y = from.y < extent.low.y ? from.y : extent.low.y;
		extent.high.x = from.x > extent.high.x ? from.x : extent.high.x;
		extent.high.y = from.y > extent.high.y ? from.y : extent.high.y;
	}
	return extent;
}

static bool extents_meet(const struct extent *a, const struct extent *b)
{
	return a->low.x < b->high.x && b->low.x < a->high.x && a->low.y < b->high.y && b->low.y < a->high.y;
}

/* Pieces that lie over each other, each at its own origin say, are set side by side in shelves. */
static void arrange(struct sheet *sheet, const struct extent *extent, uint32_t pieces)
{
	bool meet = false;
	for (uint32_t p = 0; p < pieces && !meet; p++)
		for (uint32_t q = 0; q < p && !meet; q++)
			meet = extents_meet(&extent[p], &extent[q]);
	double x = 0, y = 0, height = 0;
	for (uint32_t p = 0; p < pieces; p++) {
		sheet->offset[p] = (struct vec2){0, 0};
		if (!meet)
			continue;
		double width = extent[p].high.x - extent[p].low.x;
		if (x > 0 && x + width > SHELF_MM) {
			x = 0;
			y += height + GAP_MM;
			height = 0;
		}
		sheet->offset[p] = (struct vec2){x - extent[p].low.x, y - extent[p].low.y};
		x += width + GAP_MM;
		if (extent[p].high.y - extent[p].low.y > height)
			height = extent[p].high.y - extent[p].low.y;
	}
}

static bool lay_out(struct sheet *sheet)
{
	uint32_t pieces = sheet->result->input->garment->piece_count;
	struct extent *extent = malloc((pieces + 1) * sizeof *extent);
	sheet->offset = calloc(pieces + 1, sizeof *sheet->offset);
	if (!extent || !sheet->offset) {
		free(extent);
		return false;
	}
	for (uint32_t p = 0; p < pieces; p++)
		extent[p] = piece_extent(sheet->result, p);
	arrange(sheet, extent, pieces);
	sheet->left = sheet->bottom = INFINITY;
	sheet->right = sheet->top = -INFINITY;
	for (uint32_t p = 0; p < pieces; p++) {
		struct vec2 low = vec2_add(extent[p].low, sheet->offset[p]);
		struct vec2 high = vec2_add(extent[p].high, sheet->offset[p]);
		sheet->left = low.x < sheet->left ? low.x : sheet->left;
		sheet->bottom = low.y < sheet->bottom ? low.y : sheet->bottom;
		sheet->right = high.x > sheet->right ? high.x : sheet->right;
		sheet->top = high.y > sheet->top ? high.y : sheet->top;
	}
	free(extent);
	return true;
}

/* A point of a piece on the page: from the top left corner of the drawing, y down. */
static struct vec2 on_page(const struct sheet *sheet, uint32_t piece, struct vec2 point)
{
	struct vec2 p = vec2_add(point, sheet->offset[piece]);
	return (struct vec2){p.x - sheet->left + MARGIN_MM, sheet->top - p.y + HEADER_MM};
}

static void add_xy(const struct sheet *sheet, struct vec2 p)
{
	text_number(sheet->text, p.x, 3);
	text_add(sheet->text, " ");
	text_number(sheet->text, p.y, 3);
}

static void add_at(const struct sheet *sheet, uint32_t piece, struct vec2 point)
{
	add_xy(sheet, on_page(sheet, piece, point));
}

static void open_layer(const struct sheet *sheet, const char *id, const char *label, const char *attributes)
{
	text_format(sheet->text, "<g id=\"%s\" inkscape:groupmode=\"layer\" inkscape:label=\"%s\" %s>\n", id, label,
		    attributes);
}

static void close_layer(const struct sheet *sheet)
{
	text_add(sheet->text, "</g>\n");
}

static void add_loop(const struct sheet *sheet, const struct outline_loop *loop)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t i = 0; i < loop->count; i++) {
		struct vec2 from, to;
		outline_ends(outline, sheet->result->input->garment, loop->first + i, &from, &to);
		text_add(sheet->text, i ? "L" : "M");
		add_at(sheet, loop->piece, from);
	}
	text_add(sheet->text, "Z");
}

/* All loops of a piece are one path: holes are holes. */
static void add_outlines(const struct sheet *sheet, bool clip)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t l = 0; l < outline->loop_count;) {
		uint32_t piece = outline->loop[l].piece;
		if (clip)
			text_format(sheet->text, "<clipPath id=\"clip-%u\">", piece);
		text_format(sheet->text, "<path %sd=\"", clip ? "clip-rule=\"evenodd\" " : "");
		for (; l < outline->loop_count && outline->loop[l].piece == piece; l++)
			add_loop(sheet, &outline->loop[l]);
		text_add(sheet->text, "\"><title>");
		text_xml(sheet->text, sheet->result->input->garment->piece_name[piece]);
		text_add(sheet->text, clip ? "</title></path></clipPath>\n" : "</title></path>\n");
	}
}

/* The segments of one seam side are neighbours in their loop, but for the loop's end. */
static void add_seam_lines(const struct sheet *sheet)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t l = 0; l < outline->loop_count; l++) {
		const struct outline_loop *loop = &outline->loop[l];
		bool open = false;
		for (uint32_t i = loop->first; i < loop->first + loop->count; i++) {
			const struct outline_segment *segment = &outline->segment[i];
			struct vec2 from, to;
			outline_ends(outline, sheet->result->input->garment, i, &from, &to);
			bool goes_on = open && segment->seam == segment[-1].seam;
			if (open && !goes_on)
				text_add(sheet->text, "\"/>\n");
			open = segment->seam != GARMENT_NONE;
			if (open && !goes_on) {
				text_add(sheet->text, "<path d=\"M");
				add_at(sheet, loop->piece, from);
			}
			if (open) {
				text_add(sheet->text, "L");
				add_at(sheet, loop->piece, to);
			}
		}
		if (open)
			text_add(sheet->text, "\"/>\n");
	}
}

/* A short line across the cut line, inwards. */
static void add_tick(const struct sheet *sheet, uint32_t piece, struct vec2 at, struct vec2 inward, double length)
{
	text_add(sheet->text, "<path d=\"M");
	add_at(sheet, piece, at);
	text_add(sheet->text, "L");
	add_at(sheet, piece, vec2_along(at, inward, length));
	text_add(sheet->text, "\"/>\n");
}

/* The middle of each side of a seam, by length, gets a tick and the seam's number. */
static void add_seam_marks(const struct sheet *sheet)
{
	enum { SHORTEST_MM = 12, TICK_MM = 5, LABEL_MM = 11 };
	const struct outline *outline = sheet->result->outline;
	const struct garment *garment = sheet->result->input->garment;
	double(*run)[2] = calloc(outline->seam_count + 1, sizeof *run);
	if (!run) {
		sheet->text->failed = true;
		return;
	}
	uint32_t piece = 0;
	for (uint32_t i = 0; i < outline->segment_count; i++) {
		while (i >= outline->piece_first[piece + 1])
			piece++;
		const struct outline_segment *segment = &outline->segment[i];
		if (segment->seam == GARMENT_NONE)
			continue;
		const struct outline_seam *seam = &outline->seam[segment->seam];
		int side = piece == seam->piece[0] ? 0 : 1;
		struct vec2 from, to;
		outline_ends(outline, garment, i, &from, &to);
		double before = run[segment->seam][side], length = vec2_distance(from, to);
		double middle = seam->length_mm[side] / 2;
		run[segment->seam][side] += length;
		if (seam->length_mm[side] < SHORTEST_MM || middle < before || middle >= before + length)
			continue;
		struct vec2 inward = vec2_left(vec2_unit(vec2_sub(to, from)));
		struct vec2 at = vec2_mix(from, to, length > 0 ? (middle - before) / length : 0);
		add_tick(sheet, piece, at, inward, TICK_MM);
		struct vec2 label = on_page(sheet, piece, vec2_along(at, inward, LABEL_MM));
		text_add(sheet->text, "<text x=\"");
		text_number(sheet->text, label.x, 2);
		text_add(sheet->text, "\" y=\"");
		text_number(sheet->text, label.y + 2.5, 2);
		text_format(sheet->text, "\" stroke=\"none\">%u</text>\n", segment->seam + 1);
	}
	free(run);
}

static void add_notches(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++) {
		const struct wire *wire = &ours->wires.wire[b];
		for (uint32_t s = 0; s + 1 < wire->span_count; s++) {
			const struct span *in = &wire->span[s], *out = &wire->span[s + 1];
			if (in->piece == out->piece && vec2_distance(in->to, out->from) < 1e-6)
				continue;
			add_tick(sheet, in->piece, in->to, vec2_scale(span_direction(in, 1), -1), 4);
			add_tick(sheet, out->piece, out->from, span_direction(out, 0), 4);
		}
	}
}

/* An arc of SVG: radius, no rotation, never the large one, sweep as seen with y down. */
static void add_span_path(const struct sheet *sheet, const struct span *span, bool move)
{
	if (move) {
		text_add(sheet->text, "M");
		add_at(sheet, span->piece, span->from);
	}
	if (span_is_arc(span)) {
		text_add(sheet->text, "A");
		text_number(sheet->text, span->radius, 4);
		text_add(sheet->text, " ");
		text_number(sheet->text, span->radius, 4);
		text_format(sheet->text, " 0 0 %d ", span->turn < 0);
	} else {
		text_add(sheet->text, "L");
	}
	add_at(sheet, span->piece, span->to);
}

static void add_wires(const struct sheet *sheet, const struct solved *solved)
{
	for (uint32_t b = 0; b < solved->branches.branch_count; b++) {
		const struct wire *wire = &solved->wires.wire[b];
		if (!wire->span_count)
			continue;
		text_add(sheet->text, "<path d=\"");
		for (uint32_t s = 0; s < wire->span_count; s++)
			add_span_path(sheet, &wire->span[s],
				      s == 0 || vec2_distance(on_page(sheet, wire->span[s].piece, wire->span[s].from),
							      on_page(sheet, wire->span[s - 1].piece,
								      wire->span[s - 1].to)) > 1e-6);
		text_add(sheet->text, "\"/>\n");
	}
}

/* The strip of a stretch of a wire in one piece. At a seam it goes on a strip's width, to be cut off at the cut line.
 */
static void add_stretch(const struct sheet *sheet, const struct wire *wire, uint32_t first, uint32_t end)
{
	double width = sheet->result->field->options.strip_width_mm;
	const struct span *from = &wire->span[first], *to = &wire->span[end - 1];
	text_add(sheet->text, "<path d=\"M");
	if (first > 0) {
		add_at(sheet, from->piece, vec2_along(from->from, span_direction(from, 0), -width));
		text_add(sheet->text, "L");
	}
	add_at(sheet, from->piece, from->from);
	for (uint32_t s = first; s < end; s++)
		add_span_path(sheet, &wire->span[s], false);
	if (end < wire->span_count) {
		text_add(sheet->text, "L");
		add_at(sheet, to->piece, vec2_along(to->to, span_direction(to, 1), width));
	}
	text_add(sheet->text, "\"/>\n");
}

static void add_strips(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t piece = 0; piece < sheet->result->input->garment->piece_count; piece++) {
		text_format(sheet->text, "<g clip-path=\"url(#clip-%u)\">\n", piece);
		for (uint32_t b = 0; b < ours->branches.branch_count; b++) {
			const struct wire *wire = &ours->wires.wire[b];
			for (uint32_t s = 0, end; s < wire->span_count; s = end) {
				for (end = s + 1; end < wire->span_count; end++)
					if (wire->span[end].piece != wire->span[s].piece)
						break;
				if (wire->span[s].piece == piece)
					add_stretch(sheet, wire, s, end);
			}
		}
		text_add(sheet->text, "</g>\n");
	}
}

static void add_circle(const struct sheet *sheet, uint32_t piece, struct vec2 at, double radius)
{
	struct vec2 p = on_page(sheet, piece, at);
	text_add(sheet->text, "<circle cx=\"");
	text_number(sheet->text, p.x, 3);
	text_add(sheet->text, "\" cy=\"");
	text_number(sheet->text, p.y, 3);
	text_add(sheet->text, "\" r=\"");
	text_number(sheet->text, radius, 2);
	text_add(sheet->text, "\"/>\n");
}

static void add_label(const struct sheet *sheet, struct vec2 page, const char *label)
{
	text_add(sheet->text, "<text x=\"");
	text_number(sheet->text, page.x, 2);
	text_add(sheet->text, "\" y=\"");
	text_number(sheet->text, page.y, 2);
	text_add(sheet->text, "\">");
	text_xml(sheet->text, label);
	text_add(sheet->text, "</text>\n");
}

static void add_terminals(const struct sheet *sheet)
{
	const struct layout_result *result = sheet->result;
	const struct wire_end *end = result->ours->wires.end;
	for (uint32_t s = 0; s < result->sites->count; s++)
		add_circle(sheet, end[s].piece, end[s].at, 3);
	text_add(sheet->text, "<g stroke=\"#fff\" stroke-width=\"2.5\" paint-order=\"stroke\" font-size=\"9\">\n");
	for (uint32_t s = 0; s < result->sites->count; s++) {
		char buffer[16];
		struct vec2 p = on_page(sheet, end[s].piece, end[s].at);
		add_label(sheet, (struct vec2){p.x + 6, p.y - 5},
			  terminal_name(result->input->request, result->sites->site[s].terminal, buffer));
	}
	text_add(sheet->text, "</g>\n");
}

/* How far a point of a piece is from its cut line and from every wire. */
static double room_at(const struct layout_result *result, uint32_t piece, struct vec2 point)
{
	double room = outline_distance(result->outline, result->input->garment, piece, point, NULL);
	struct place place;
	locator_find(result->locator, piece, point, &place);
	if (place.distance > 0)
		return -place.distance;
	const struct solved *ours = result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++) {
		const struct wire *wire = &ours->wires.wire[b];
		for (uint32_t s = 0; s < wire->span_count; s++) {
			const struct span *span = &wire->span[s];
			if (span->piece != piece)
				continue;
			double distance = vec2_distance(point, span_point(span, span_nearest(span, point)));
			room = distance < room ? distance : room;
		}
	}
	return room;
}

/* The middle of the face around which a name has most room. */
static struct vec2 roomiest(const struct layout_result *result, uint32_t piece, uint32_t faces)
{
	enum { TRIES = 300, HALF_NAME_MM = 45 };
	const struct garment *garment = result->input->garment;
	uint32_t step = faces / TRIES + 1, seen = 0;
	double best = -INFINITY;
	struct vec2 at = {0, 0};
	for (uint32_t f = 0; f < garment->face_count; f++) {
		if (garment->face_piece[f] != piece || seen++ % step)
			continue;
		struct place place = {.face = f, .barycentric = {1.0 / 3, 1.0 / 3, 1.0 / 3}};
		struct vec2 middle = place_on_pattern(garment, &place);
		double room = INFINITY;
		for (int side = -1; side <= 1; side++) {
			double here = room_at(result, piece, (struct vec2){middle.x + side * HALF_NAME_MM, middle.y});
			room = here < room ? here : room;
		}
		if (room > best) {
			best = room;
			at = middle;
		}
	}
	return at;
}

/* So small that the name takes half the piece's width, which leaves room for wires and where the piece narrows; a glyph
 * is about 0.65 of its size wide. */
static double name_size(const struct layout_result *result, uint32_t piece)
{
	struct extent extent = piece_extent(result, piece);
	size_t length = strlen(result->input->garment->piece_name[piece]);
	return fmax(6, fmin(18, 0.5 * (extent.high.x - extent.low.x) / (0.65 * (double)(length + 1))));
}

static void add_piece_names(const struct sheet *sheet)
{
	const struct garment *garment = sheet->result->input->garment;
	uint32_t *faces = calloc(garment->piece_count + 1, sizeof *faces);
	if (!faces) {
		sheet->text->failed = true;
		return;
	}
	for (uint32_t f = 0; f < garment->face_count; f++)
		faces[garment->face_piece[f]]++;
	for (uint32_t p = 0; p < garment->piece_count; p++) {
		struct vec2 at = on_page(sheet, p, roomiest(sheet->result, p, faces[p]));
		text_format(sheet->text, "<g font-size=\"%.1f\">\n", name_size(sheet->result, p));
		add_label(sheet, (struct vec2){at.x, at.y + 6}, garment->piece_name[p]);
		text_add(sheet->text, "</g>\n");
		at.y += 14;
		text_format(sheet->text,
			    "<path d=\"M%.2f %.2fv60m-3 -8l3 8l3 -8m-6 -44l3 -8l3 8\" fill=\"none\" "
			    "stroke=\"#555\" stroke-width=\"0.6\"/>\n",
			    at.x, at.y);
	}
	free(faces);
}

static void add_scale(const struct sheet *sheet)
{
	text_add(sheet->text, "<path d=\"M30 30h100v100h-100z\" fill=\"none\" stroke-width=\"0.5\"/>\n"
			      "<path d=\"M30 130");
	for (int i = 1; i < 10; i++)
		text_format(sheet->text, "m10 0v-%dv%d", i == 5 ? 6 : 3, i == 5 ? 6 : 3);
	text_add(sheet->text, "\" fill=\"none\" stroke-width=\"0.4\"/>\n"
			      "<g font-size=\"9\" stroke=\"none\" text-anchor=\"middle\">\n"
			      "<text x=\"80\" y=\"76\">100 × 100 mm</text>\n"
			      "<text x=\"80\" y=\"92\">print at 100 %</text>\n"
			      "</g>\n");
	const struct layout_result *result = sheet->result;
	text_format(sheet->text,
		    "<text x=\"150\" y=\"48\" stroke=\"none\" font-size=\"20\">tightwire layout: %u terminals, "
		    "%u branches, %.0f mm of wire</text>\n",
		    result->sites->count, result->ours->branches.branch_count, result->ours->metrics.total.length_mm);
	text_format(sheet->text,
		    "<text x=\"150\" y=\"70\" stroke=\"none\">strip %g mm wide, smallest radius %g mm; equal numbers "
		    "on cut lines are sewn together; grain along the arrows</text>\n",
		    result->field->options.strip_width_mm, result->rules->minimum_radius_mm);
}

static void add_violations(const struct sheet *sheet)
{
	const struct layout_metrics *metrics = &sheet->result->ours->metrics;
	for (uint32_t i = 0; i < metrics->violation_count; i++)
		add_circle(sheet, metrics->violation[i].piece, metrics->violation[i].at, 8);
}

static void add_junctions(const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t e = sheet->result->sites->count; e < ours->branches.end_count; e++)
		add_circle(sheet, ours->wires.end[e].piece, ours->wires.end[e].at, 1.6);
}

static void open_drawing(const struct sheet *sheet)
{
	double width = sheet->right - sheet->left + 2 * MARGIN_MM;
	double height = sheet->top - sheet->bottom + MARGIN_MM + HEADER_MM;
	width = width < 900 ? 900 : width; /* the header's room */
	text_add(sheet->text, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
			      "<svg xmlns=\"http://www.w3.org/2000/svg\" "
			      "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" width=\"");
	text_number(sheet->text, width, 3);
	text_add(sheet->text, "mm\" height=\"");
	text_number(sheet->text, height, 3);
	text_add(sheet->text, "mm\" viewBox=\"0 0 ");
	text_number(sheet->text, width, 3);
	text_add(sheet->text, " ");
	text_number(sheet->text, height, 3);
	text_add(sheet->text, "\" font-family=\"sans-serif\" font-size=\"12\">\n"
			      "<title>tightwire pattern, millimetres, true scale</title>\n"
			      "<rect id=\"page\" width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
}

void write_pattern_svg(const struct layout_result *result, struct text *text)
{
	struct sheet sheet = {.result = result, .text = text};
	if (!lay_out(&sheet)) {
		text->failed = true;
		free(sheet.offset);
		return;
	}
	open_drawing(&sheet);
	open_layer(&sheet, "fabric", "fabric", "fill=\"#f4f1ea\" stroke=\"none\" fill-rule=\"evenodd\"");
	add_outlines(&sheet, false);
	close_layer(&sheet);
	open_layer(&sheet, "strips", "wire strips",
		   "fill=\"none\" stroke=\"#e8a33d\" stroke-opacity=\"0.55\" stroke-linejoin=\"round\"");
	text_add(text, "<defs>\n");
	add_outlines(&sheet, true);
	text_add(text, "</defs>\n<g stroke-width=\"");
	text_number(text, result->field->options.strip_width_mm, 4);
	text_add(text, "\">\n");
	add_strips(&sheet);
	text_add(text, "</g>\n");
	close_layer(&sheet);
	open_layer(&sheet, "cut-line", "cut line", "fill=\"none\" stroke=\"#000\" stroke-width=\"0.6\"");
	add_outlines(&sheet, false);
	close_layer(&sheet);
	open_layer(&sheet, "seams", "seams", "fill=\"none\" stroke=\"#1f6fb2\" stroke-width=\"1\"");
	text_add(text, "<g stroke-dasharray=\"6 3\">\n");
	add_seam_lines(&sheet);
	text_add(text, "</g>\n<g font-size=\"8\" fill=\"#1f6fb2\" text-anchor=\"middle\">\n");
	add_seam_marks(&sheet);
	text_add(text, "</g>\n");
	close_layer(&sheet);
	open_layer(&sheet, "notches", "wire notches", "fill=\"none\" stroke=\"#000\" stroke-width=\"1.2\"");
	add_notches(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "wires", "wire centre lines",
		   "fill=\"none\" stroke=\"#b3261e\" stroke-width=\"1.2\" stroke-linejoin=\"round\"");
	add_wires(&sheet, result->ours);
	close_layer(&sheet);
	open_layer(&sheet, "junctions", "junctions", "fill=\"#b3261e\" stroke=\"none\"");
	add_junctions(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "terminals", "terminals", "fill=\"#14532d\"");
	add_terminals(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "violations", "design-rule violations",
		   "fill=\"none\" stroke=\"#c2185b\" stroke-width=\"1.5\"");
	add_violations(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "pieces", "piece names and grain", "fill=\"#333\" text-anchor=\"middle\"");
	add_piece_names(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "scale", "scale", "fill=\"#333\" stroke=\"#333\"");
	add_scale(&sheet);
	close_layer(&sheet);
	text_add(text, "</svg>\n");
	free(sheet.offset);
}
