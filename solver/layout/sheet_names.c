/* All lettering of the sheet. Numbers of seams lie where their seams are; the names of pieces where a piece has most
 * room beside wires and terminals; the names of terminals then find a place beside their points that keeps off both,
 * off wires and off cut lines. */
#include "solver/layout/sheet_names.h"

enum { SEAM_SHORTEST_MM = 12, SEAM_TICK_MM = 5, SEAM_LABEL_MM = 11, SEAM_LETTER_MM = 8, DOT_MM = 6 };
enum { GRAIN_MM = 60, GRAIN_GAP_MM = 8 };
enum { TERMINAL_LETTER_MM = 9, WIRE_STEP_MM = 6 };

/* What room is looked for beside: the spans of every piece. */
struct surroundings {
	const struct layout_result *result;
	const struct span **span; /* [first[piece_count]] by piece */
	uint32_t *first;          /* [piece_count + 1] */
};

static enum tw_status find_surroundings(struct surroundings *around, const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	uint32_t pieces = sheet->result->input->garment->piece_count, count = 0;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++)
		count += ours->wires.wire[b].span_count;
	around->result = sheet->result;
	around->span = ARENA_ARRAY(sheet->arena, count, const struct span *);
	around->first = ARENA_ARRAY(sheet->arena, (size_t)pieces + 1, uint32_t);
	if (!around->span || !around->first)
		return tw_fail_memory(NULL);
	around->first[0] = 0;
	for (uint32_t p = 0, at = 0; p < pieces; p++) {
		for (uint32_t b = 0; b < ours->branches.branch_count; b++)
			for (uint32_t s = 0; s < ours->wires.wire[b].span_count; s++)
				if (ours->wires.wire[b].span[s].piece == p)
					around->span[at++] = &ours->wires.wire[b].span[s];
		around->first[p + 1] = at;
	}
	return TW_OK;
}

/* How far a point of a piece is from the middle of every wire, and from every terminal. */
static double room_beside_wires(const struct surroundings *around, uint32_t piece, struct vec2 point)
{
	const struct site_set *sites = around->result->sites;
	double room = INFINITY;
	for (uint32_t i = around->first[piece]; i < around->first[piece + 1]; i++) {
		const struct span *span = around->span[i];
		/* No point of a span is farther from its first than the span is long. */
		if (vec2_distance(point, span->from) - span_length(span) < room)
			room = fmin(room, vec2_distance(point, span_point(span, span_nearest(span, point))));
	}
	for (uint32_t s = 0; s < sites->count; s++)
		for (uint32_t m = 0; m < sites->site[s].mark_count; m++) {
			const struct site_mark *mark = &sites->site[s].mark[m];
			if (mark->piece == piece)
				room = fmin(room, vec2_distance(point, mark->at));
		}
	return room;
}

/* How far a point is from its piece's cut line; negative outside. */
static double room_in_piece(const struct layout_result *result, uint32_t piece, struct vec2 point)
{
	double room = outline_distance(result->outline, result->input->garment, piece, point, NULL);
	return outline_contains(result->outline, result->input->garment, piece, point) ? room : -room;
}

/* Beside the seam's middle, or along the seam as near to it as strips leave room for a number. */
static struct vec2 place_number(const struct surroundings *around, const struct seam_middle *middle)
{
	enum { STEP_MM = 6, STEPS = 20 };
	double strip = around->result->field->options.strip_width_mm / 2, least = SEAM_LETTER_MM / 2.0;
	struct vec2 first = vec2_along(middle->at, middle->inward, SEAM_LABEL_MM), best = first;
	double best_room = -INFINITY;
	for (int step = 0; step <= STEPS; step++) {
		int places = (step + 1) / 2 * (step % 2 ? 1 : -1);
		double along = (double)places * STEP_MM;
		struct vec2 at = vec2_along(first, vec2_left(middle->inward), along);
		if (room_in_piece(around->result, middle->piece, at) < least)
			continue;
		double room = room_beside_wires(around, middle->piece, at);
		if (room > best_room) {
			best_room = room;
			best = at;
		}
		if (room > strip + SEAM_LETTER_MM)
			break;
	}
	return best;
}

static enum tw_status find_seams(struct sheet_names *names, const struct sheet *sheet,
				 const struct surroundings *around)
{
	const struct outline *outline = sheet->result->outline;
	struct seam_middle(*middle)[2];
	enum tw_status status =
		outline_seam_middles(outline, sheet->result->input->garment, sheet->arena, &middle, NULL);
	names->seam = ARENA_ARRAY(sheet->arena, 2 * (size_t)outline->seam_count, struct seam_mark);
	if (status != TW_OK || !names->seam)
		return tw_fail_memory(NULL);
	for (uint32_t seam = 0; seam < outline->seam_count; seam++)
		for (int side = 0; side < 2; side++) {
			const struct seam_middle *at = &middle[seam][side];
			if (outline->seam[seam].length_mm[side] < SEAM_SHORTEST_MM)
				continue;
			names->seam[names->seam_count++] = (struct seam_mark){
				.number = seam + 1,
				.middle = *at,
				.label = sheet_point(sheet, at->piece, place_number(around, at)),
			};
		}
	return TW_OK;
}

static double room_at(const struct surroundings *around, uint32_t piece, struct vec2 point)
{
	return fmin(room_beside_wires(around, piece, point), room_in_piece(around->result, piece, point));
}

/* The least room along a name, and along the grain line below it, which may pass wires a little nearer. No more than
 * `least` matters where it is less than that. */
static double room_for_name(const struct surroundings *around, uint32_t piece, struct vec2 middle, double half_name,
			    double least)
{
	enum { GRAIN_SLACK_MM = 10, NAME_POINTS = 2, GRAIN_POINTS = 4 };
	double room = INFINITY;
	for (int side = -NAME_POINTS; side <= NAME_POINTS && room > least; side++) {
		struct vec2 at = {middle.x + side * half_name / NAME_POINTS, middle.y};
		room = fmin(room, room_at(around, piece, at));
	}
	for (int step = 1; step <= GRAIN_POINTS && room > least; step++) {
		struct vec2 below = {middle.x, middle.y - step * (double)(GRAIN_MM + GRAIN_GAP_MM) / GRAIN_POINTS};
		room = fmin(room, room_at(around, piece, below) + GRAIN_SLACK_MM);
	}
	return room;
}

/* The middle of the face around which a name has most room, and how much. */
static struct vec2 roomiest(const struct surroundings *around, uint32_t piece, uint32_t faces, double half_name,
			    double *most)
{
	enum { TRIES = 300 };
	const struct garment *garment = around->result->input->garment;
	uint32_t step = faces / TRIES + 1, seen = 0;
	struct vec2 at = {0, 0};
	*most = -INFINITY;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		if (garment->face_piece[f] != piece || seen++ % step)
			continue;
		struct place place = {.face = f, .barycentric = {1.0 / 3, 1.0 / 3, 1.0 / 3}};
		struct vec2 middle = place_on_pattern(garment, &place);
		double room = room_for_name(around, piece, middle, half_name, *most);
		if (room > *most) {
			*most = room;
			at = middle;
		}
	}
	return at;
}

/* So small that the name takes half the piece's width, which leaves room for wires and where the piece narrows. */
static double name_size(const struct sheet *sheet, uint32_t piece)
{
	struct extent extent = sheet_extent(sheet, piece);
	double width = label_width(sheet->result->input->garment->piece_name[piece], 1) + 1;
	return fmax(6, fmin(18, 0.45 * (extent.high.x - extent.low.x) / width));
}

/* In a crowded piece a name becomes smaller, until it keeps off the strips. */
static struct piece_name place_name(const struct sheet *sheet, const struct surroundings *around, uint32_t piece,
				    uint32_t faces)
{
	static const double shares[] = {1, 0.75, 0.55};
	const char *name = sheet->result->input->garment->piece_name[piece];
	double most = -INFINITY, strip = sheet->result->field->options.strip_width_mm / 2;
	struct piece_name best = {{0, 0}, 0};
	for (size_t i = 0; i < sizeof shares / sizeof *shares; i++) {
		double size = shares[i] * name_size(sheet, piece), room;
		struct vec2 at = roomiest(around, piece, faces, label_width(name, size) / 2, &room);
		if (room <= most)
			continue;
		most = room;
		at = sheet_point(sheet, piece, at);
		best = (struct piece_name){{at.x, at.y - size / 3}, size};
		if (room > strip + size / 2)
			break;
	}
	return best;
}

static enum tw_status find_pieces(struct sheet_names *names, const struct sheet *sheet,
				  const struct surroundings *around)
{
	const struct garment *garment = sheet->result->input->garment;
	uint32_t *faces = ARENA_ZEROED(sheet->arena, garment->piece_count, uint32_t);
	names->piece = ARENA_ARRAY(sheet->arena, garment->piece_count, struct piece_name);
	if (!faces || !names->piece)
		return tw_fail_memory(NULL);
	for (uint32_t f = 0; f < garment->face_count; f++)
		faces[garment->face_piece[f]]++;
	for (uint32_t p = 0; p < garment->piece_count; p++)
		names->piece[p] = place_name(sheet, around, p, faces[p]);
	return TW_OK;
}

/* What the names of terminals keep off: other lettering and dots as much as each other, wires and cut lines where they
 * can. */
static void block_lettering(struct label_page *page, const struct sheet_names *names, const struct sheet *sheet)
{
	const struct garment *garment = sheet->result->input->garment;
	for (uint32_t i = 0; i < names->seam_count; i++)
		label_page_block(page, sheet_flip(sheet, names->seam[i].label), SEAM_LETTER_MM + 2, LABEL_PRICE);
	for (uint32_t p = 0; p < garment->piece_count; p++) {
		struct vec2 at = sheet_flip(sheet, names->piece[p].at);
		double half = label_width(garment->piece_name[p], names->piece[p].size) / 2;
		label_page_block_box(
			page, (struct label_box){at.x - half, at.y - names->piece[p].size, at.x + half, at.y + 4},
			LABEL_PRICE);
		label_page_block_box(page, (struct label_box){at.x - 4, at.y, at.x + 4, at.y + GRAIN_MM + GRAIN_GAP_MM},
				     3);
	}
	for (uint32_t l = 0; l < page->label_count; l++)
		label_page_block(page, page->label[l].at, DOT_MM, LABEL_PRICE);
}

static uint32_t steps_of(const struct span *span)
{
	return (uint32_t)(span_length(span) / WIRE_STEP_MM) + 1;
}

static void block_wires(struct label_page *page, const struct sheet *sheet)
{
	const struct solved *ours = sheet->result->ours;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++)
		for (uint32_t s = 0; s < ours->wires.wire[b].span_count; s++) {
			const struct span *span = &ours->wires.wire[b].span[s];
			for (uint32_t i = 0, steps = steps_of(span); i < steps; i++) {
				struct vec2 point = span_point(span, (i + 0.5) / steps);
				label_page_block(page, sheet_flip(sheet, sheet_point(sheet, span->piece, point)),
						 WIRE_STEP_MM, 1);
			}
		}
}

static void block_cut_lines(struct label_page *page, const struct sheet *sheet)
{
	const struct outline *outline = sheet->result->outline;
	for (uint32_t piece = 0; piece < sheet->result->input->garment->piece_count; piece++)
		for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
			struct vec2 from, to;
			outline_ends(outline, sheet->result->input->garment, i, &from, &to);
			label_page_block(page, sheet_flip(sheet, sheet_point(sheet, piece, vec2_mix(from, to, 0.5))),
					 fmax(1, vec2_distance(from, to) / 2), 3);
		}
}

static uint32_t count_wire_steps(const struct solved *ours)
{
	uint32_t steps = 0;
	for (uint32_t b = 0; b < ours->branches.branch_count; b++)
		for (uint32_t s = 0; s < ours->wires.wire[b].span_count; s++)
			steps += steps_of(&ours->wires.wire[b].span[s]);
	return steps;
}

static const char *name_of(const struct sheet *sheet, uint32_t site, char *buffer)
{
	return terminal_name(sheet->result->input->request, sheet->result->sites->site[site].terminal, buffer);
}

static uint32_t count_marks(const struct site_set *sites)
{
	uint32_t marks = 0;
	for (uint32_t s = 0; s < sites->count; s++)
		marks += sites->site[s].mark_count;
	return marks;
}

static enum tw_status find_terminals(struct sheet_names *names, const struct sheet *sheet)
{
	const struct layout_result *result = sheet->result;
	uint32_t count = count_marks(result->sites);
	uint32_t blocks = names->seam_count + 2 * result->input->garment->piece_count + count +
			  count_wire_steps(result->ours) + result->outline->segment_count;
	enum tw_status status =
		label_page_init(&names->terminals, sheet->arena, (struct label_box){0, 0, sheet->width, sheet->height},
				DOT_MM, count, blocks, NULL);
	if (status != TW_OK)
		return status;
	for (uint32_t s = 0; s < result->sites->count; s++)
		for (uint32_t m = 0; m < result->sites->site[s].mark_count; m++) {
			const struct site_mark *mark = &result->sites->site[s].mark[m];
			char buffer[16];
			label_page_add(&names->terminals, sheet_flip(sheet, sheet_point(sheet, mark->piece, mark->at)),
				       name_of(sheet, s, buffer), TERMINAL_LETTER_MM);
		}
	block_lettering(&names->terminals, names, sheet);
	block_wires(&names->terminals, sheet);
	block_cut_lines(&names->terminals, sheet);
	label_page_settle(&names->terminals);
	return TW_OK;
}

enum tw_status sheet_names_find(struct sheet_names *names, const struct sheet *sheet)
{
	*names = (struct sheet_names){0};
	struct surroundings around;
	enum tw_status status = find_surroundings(&around, sheet);
	if (status == TW_OK)
		status = find_seams(names, sheet, &around);
	if (status == TW_OK)
		status = find_pieces(names, sheet, &around);
	return status != TW_OK ? status : find_terminals(names, sheet);
}

/* --- drawing ---------------------------------------------------------------------------------------------------- */

void sheet_names_add_seams(const struct sheet_names *names, const struct sheet *sheet)
{
	static const struct drawing_style tick_style = {.name = "seam-middle", .stroke = "#1f6fb2", .stroke_mm = 1};
	static const struct drawing_style number_style = {.name = "seam-number", .fill = "#1f6fb2"};
	static const double below_middle_mm = 2.5; /* the base line of a number */
	for (uint32_t i = 0; i < names->seam_count; i++) {
		const struct seam_middle *middle = &names->seam[i].middle;
		drawing_add_line(
			sheet->drawing, &tick_style, middle->piece, sheet_point(sheet, middle->piece, middle->at),
			sheet_point(sheet, middle->piece, vec2_along(middle->at, middle->inward, SEAM_TICK_MM)));
	}
	for (uint32_t i = 0; i < names->seam_count; i++) {
		const struct seam_mark *mark = &names->seam[i];
		const struct drawing_text text = {.at = {mark->label.x, mark->label.y - below_middle_mm},
						  .size_mm = SEAM_LETTER_MM,
						  .anchor = DRAWING_MIDDLE,
						  .text = drawing_format(sheet->drawing, "%u", mark->number)};
		drawing_add_text(sheet->drawing, &number_style, mark->middle.piece, &text);
	}
}

/* An arrow at both ends. */
static void add_grain(const struct sheet *sheet, uint32_t piece, struct vec2 top)
{
	static const struct drawing_style style = {.name = "grain", .stroke = "#555555", .stroke_mm = 0.6};
	enum { HEAD_MM = 8, HEAD_HALF_MM = 3 };
	struct vec2 bottom = {top.x, top.y - GRAIN_MM};
	struct drawing_item *path = drawing_add_path(sheet->drawing, &style, piece, false);
	drawing_move_to(sheet->drawing, path, top);
	drawing_line_to(sheet->drawing, path, bottom);
	drawing_move_to(sheet->drawing, path, (struct vec2){bottom.x - HEAD_HALF_MM, bottom.y + HEAD_MM});
	drawing_line_to(sheet->drawing, path, bottom);
	drawing_line_to(sheet->drawing, path, (struct vec2){bottom.x + HEAD_HALF_MM, bottom.y + HEAD_MM});
	drawing_move_to(sheet->drawing, path, (struct vec2){top.x - HEAD_HALF_MM, top.y - HEAD_MM});
	drawing_line_to(sheet->drawing, path, top);
	drawing_line_to(sheet->drawing, path, (struct vec2){top.x + HEAD_HALF_MM, top.y - HEAD_MM});
}

void sheet_names_add_pieces(const struct sheet_names *names, const struct sheet *sheet)
{
	static const struct drawing_style style = {.name = "piece-name", .fill = "#333333"};
	const struct garment *garment = sheet->result->input->garment;
	for (uint32_t p = 0; p < garment->piece_count; p++) {
		const struct drawing_text text = {.at = names->piece[p].at,
						  .size_mm = names->piece[p].size,
						  .anchor = DRAWING_MIDDLE,
						  .text = garment->piece_name[p]};
		drawing_add_text(sheet->drawing, &style, p, &text);
	}
	for (uint32_t p = 0; p < garment->piece_count; p++)
		add_grain(sheet, p, (struct vec2){names->piece[p].at.x, names->piece[p].at.y - GRAIN_GAP_MM});
}

void sheet_names_add_terminals(const struct sheet_names *names, const struct sheet *sheet)
{
	static const struct drawing_style style = {
		.name = "terminal-name", .fill = "#14532d", .stroke = "#ffffff", .stroke_mm = 2.5, .halo = true};
	static const enum drawing_anchor anchors[] = {
		[LABEL_START] = DRAWING_START, [LABEL_MIDDLE] = DRAWING_MIDDLE, [LABEL_END] = DRAWING_END};
	const struct site_set *sites = sheet->result->sites;
	const struct label *label = names->terminals.label;
	for (uint32_t s = 0; s < sites->count; s++) {
		char buffer[16];
		const char *name = drawing_format(sheet->drawing, "%s", name_of(sheet, s, buffer));
		for (uint32_t m = 0; m < sites->site[s].mark_count; m++, label++) {
			const struct drawing_text text = {.at = sheet_flip(sheet, label->text),
							  .size_mm = TERMINAL_LETTER_MM,
							  .anchor = anchors[label->anchor],
							  .text = name};
			drawing_add_text(sheet->drawing, &style, sites->site[s].mark[m].piece, &text);
		}
	}
}
