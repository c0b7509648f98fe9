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
#include "solver/layout/sheet_names.h"

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
		sheet_add_at(sheet, loop->piece, from);
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
				sheet_add_at(sheet, loop->piece, from);
			}
			if (open) {
				text_add(sheet->text, "L");
				sheet_add_at(sheet, loop->piece, to);
			}
		}
		if (open)
			text_add(sheet->text, "\"/>\n");
	}
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
			sheet_add_tick(sheet, in->piece, in->to, vec2_scale(span_direction(in, 1), -1), 4);
			sheet_add_tick(sheet, out->piece, out->from, span_direction(out, 0), 4);
		}
	}
}

/* An arc of SVG: radius, no rotation, never the large one, sweep as seen with y down. */
static void add_span_path(const struct sheet *sheet, const struct span *span, bool move)
{
	if (move) {
		text_add(sheet->text, "M");
		sheet_add_at(sheet, span->piece, span->from);
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
	sheet_add_at(sheet, span->piece, span->to);
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
				      s == 0 ||
					      vec2_distance(sheet_point(sheet, wire->span[s].piece, wire->span[s].from),
							    sheet_point(sheet, wire->span[s - 1].piece,
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
		sheet_add_at(sheet, from->piece, vec2_along(from->from, span_direction(from, 0), -width));
		text_add(sheet->text, "L");
	}
	sheet_add_at(sheet, from->piece, from->from);
	for (uint32_t s = first; s < end; s++)
		add_span_path(sheet, &wire->span[s], false);
	if (end < wire->span_count) {
		text_add(sheet->text, "L");
		sheet_add_at(sheet, to->piece, vec2_along(to->to, span_direction(to, 1), width));
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
	struct vec2 p = sheet_point(sheet, piece, at);
	text_add(sheet->text, "<circle cx=\"");
	text_number(sheet->text, p.x, 3);
	text_add(sheet->text, "\" cy=\"");
	text_number(sheet->text, p.y, 3);
	text_add(sheet->text, "\" r=\"");
	text_number(sheet->text, radius, 2);
	text_add(sheet->text, "\"/>\n");
}

static void add_terminals(const struct sheet *sheet)
{
	const struct wire_end *end = sheet->result->ours->wires.end;
	for (uint32_t s = 0; s < sheet->result->sites->count; s++)
		add_circle(sheet, end[s].piece, end[s].at, 3);
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
	text_add(sheet->text, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
			      "<svg xmlns=\"http://www.w3.org/2000/svg\" "
			      "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" width=\"");
	text_number(sheet->text, sheet->width, 3);
	text_add(sheet->text, "mm\" height=\"");
	text_number(sheet->text, sheet->height, 3);
	text_add(sheet->text, "mm\" viewBox=\"0 0 ");
	text_number(sheet->text, sheet->width, 3);
	text_add(sheet->text, " ");
	text_number(sheet->text, sheet->height, 3);
	text_add(sheet->text, "\" font-family=\"sans-serif\" font-size=\"12\">\n"
			      "<title>tightwire pattern, millimetres, true scale</title>\n"
			      "<rect id=\"page\" width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
}

void write_pattern_svg(const struct layout_result *result, struct text *text)
{
	struct arena *arena = arena_new(0);
	struct sheet sheet = {.result = result, .text = text, .arena = arena};
	struct sheet_names names;
	if (!arena || sheet_arrange(&sheet) || sheet_names_find(&names, &sheet)) {
		text->failed = true;
		arena_free(arena);
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
	text_add(text, "</g>\n");
	sheet_names_add_seams(&names, &sheet);
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
	sheet_names_add_terminals(&names, &sheet);
	close_layer(&sheet);
	open_layer(&sheet, "violations", "design-rule violations",
		   "fill=\"none\" stroke=\"#c2185b\" stroke-width=\"1.5\"");
	add_violations(&sheet);
	close_layer(&sheet);
	open_layer(&sheet, "pieces", "piece names and grain", "fill=\"#333\" text-anchor=\"middle\"");
	sheet_names_add_pieces(&names, &sheet);
	close_layer(&sheet);
	open_layer(&sheet, "scale", "scale", "fill=\"#333\" stroke=\"#333\"");
	add_scale(&sheet);
	close_layer(&sheet);
	text_add(text, "</svg>\n");
	arena_free(arena);
}
