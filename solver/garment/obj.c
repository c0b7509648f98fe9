/* The strict reader of OBJ.
 *
 * Pass one counts, pass two fills arrays of exactly that size. Coordinates are kept in double and the file's own
 * numbering of `vt` is kept, which OpenMesh does neither; it reads the same file in openmesh.cc and must have seen the
 * same mesh, so that a file that two readers understand differently is refused rather than guessed at.
 *
 * Every number must be one and finite, every index must be within the file, and either all corners have a `vt` or none.
 */
#include "solver/garment/openmesh.h"
#include "solver/garment/soup.h"

#include <stdlib.h>
#include <string.h>

enum keyword { LINE_OTHER, LINE_VERTEX, LINE_COORD, LINE_FACE, LINE_GROUP, LINE_OBJECT, LINE_MATERIAL, LINE_SKIPPED };

struct obj {
	struct soup *soup;
	struct text text;
	uint32_t line;                           /* of the logical line in hand, its last physical one */
	uint32_t vertex, coord, polygon, corner; /* filled so far */
	bool has_coords;
	uint32_t labels[LABEL_KINDS]; /* seen so far */
	uint32_t label_limit[LABEL_KINDS];
	struct garment_report *report;
	struct tw_error *error;
};

static enum keyword keyword_of(const struct text *word)
{
	static const struct {
		const char *text;
		enum keyword keyword;
	} keywords[] = {
		{"v", LINE_VERTEX},   {"vt", LINE_COORD},        {"f", LINE_FACE},     {"g", LINE_GROUP},
		{"o", LINE_OBJECT},   {"usemtl", LINE_MATERIAL}, {"vn", LINE_SKIPPED}, {"vp", LINE_SKIPPED},
		{"s", LINE_SKIPPED},  {"l", LINE_SKIPPED},       {"p", LINE_SKIPPED},  {"mtllib", LINE_SKIPPED},
		{"mg", LINE_SKIPPED},
	};
	for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++) {
		if (text_equals(word, keywords[i].text))
			return keywords[i].keyword;
	}
	return LINE_OTHER;
}

static bool is_name(enum keyword keyword)
{
	return keyword == LINE_GROUP || keyword == LINE_OBJECT || keyword == LINE_MATERIAL;
}

bool obj_next_line(struct text *text, struct text *line, uint32_t *lines)
{
	struct text rest, word;
	if (!text_next_line(text, line, lines))
		return false;
	rest = *line;
	/* A name may end in a backslash, or in a letter of Shift-JIS or Big5 whose second byte is one; so may a
	 * comment. */
	if (line->end == line->at || line->end[-1] != '\\' || !text_next_word(&rest, &word) ||
	    is_name(keyword_of(&word)) || text_equals(&word, "mtllib"))
		return true;
	while (text_join_line(text, line, lines))
		;
	return true;
}

static enum label_kind label_of(enum keyword keyword)
{
	return keyword == LINE_GROUP ? LABEL_GROUP : keyword == LINE_MATERIAL ? LABEL_MATERIAL : LABEL_OBJECT;
}

static enum tw_status count_lines(struct obj *obj)
{
	struct soup *soup = obj->soup;
	struct text text = obj->text, line, word;
	uint64_t vertices = 0, coords = 0, polygons = 0, corners = 0, others = 0;
	uint32_t first_other = 0;
	for (uint32_t number = 0; obj_next_line(&text, &line, &number);) {
		if (memchr(line.at, '\0', (size_t)(line.end - line.at)))
			return fail_at_line(obj->error, "mesh-not-text", number,
					    "there is a zero byte in the file: it is damaged or not an OBJ file");
		if (!text_next_word(&line, &word))
			continue;
		enum keyword keyword = keyword_of(&word);
		if (keyword == LINE_VERTEX)
			vertices++;
		else if (keyword == LINE_COORD)
			coords++;
		else if (is_name(keyword))
			obj->label_limit[label_of(keyword)]++;
		else if (keyword == LINE_OTHER && others++ == 0)
			first_other = number;
		if (keyword == LINE_OTHER)
			warning_add(&obj->report->warnings, "lines-ignored", "line", number,
				    "lines that begin with an unknown word were ignored");
		if (keyword != LINE_FACE)
			continue;
		polygons++;
		while (text_next_word(&line, &word))
			corners++;
	}
	if (others > vertices + coords + polygons)
		return fail_at_line(
			obj->error, "mesh-unknown-format", first_other,
			"this is no mesh: the lines of an OBJ begin with v (x y z), vt (u v) and f (corners), a "
			"PLY begins with `ply`, an OFF with `OFF`, a text STL with `solid`; export one of these");
	enum tw_status status = check_counts(vertices, polygons, obj->error);
	if (status == TW_OK) /* a vertex lies in few pieces, a face has few corners */
		status = check_counts(coords / 4, corners / 4, obj->error);
	if (status != TW_OK)
		return status;
	soup->vertex_count = (uint32_t)vertices;
	soup->coord_count = (uint32_t)coords;
	soup->polygon_count = (uint32_t)polygons;
	soup->corner_count = (uint32_t)corners;
	return TW_OK;
}

static enum tw_status allocate(struct obj *obj, struct arena *arena)
{
	struct soup *soup = obj->soup;
	soup->position = ARENA_ARRAY(arena, 3 * (size_t)soup->vertex_count, double);
	soup->coord = ARENA_ARRAY(arena, 2 * (size_t)soup->coord_count, double);
	soup->polygon_start = ARENA_ARRAY(arena, (size_t)soup->polygon_count + 1, uint32_t);
	soup->corner_vertex = ARENA_ARRAY(arena, soup->corner_count, uint32_t);
	soup->corner_coord = ARENA_ARRAY(arena, soup->corner_count, uint32_t);
	soup->polygon_line = ARENA_ARRAY(arena, soup->polygon_count, uint32_t);
	if (!soup->position || !soup->coord || !soup->polygon_start || !soup->corner_vertex || !soup->corner_coord ||
	    !soup->polygon_line)
		return tw_fail_memory(obj->error);
	for (int kind = 0; kind < LABEL_KINDS; kind++) {
		soup->polygon_label[kind] = ARENA_ARRAY(arena, soup->polygon_count, uint32_t);
		soup->label[kind] = ARENA_ARRAY(arena, obj->label_limit[kind], struct text);
		if (!soup->polygon_label[kind] || !soup->label[kind])
			return tw_fail_memory(obj->error);
	}
	return TW_OK;
}

/* Reads between `least` and `most` numbers; the first `keep` go to `numbers`. */
static enum tw_status read_numbers(struct obj *obj, struct text *line, const char *what, uint32_t least, uint32_t most,
				   uint32_t keep, double *numbers)
{
	struct text word;
	uint32_t count = 0;
	for (; text_next_word(line, &word); count++) {
		double number = 0;
		if (!text_to_number(&word, &number))
			return fail_at_line(obj->error, "mesh-not-a-number", obj->line,
					    "\"%.*s\" is not a finite number",
					    (int)(word.end - word.at > 40 ? 40 : word.end - word.at), word.at);
		if (count < keep)
			numbers[count] = number;
	}
	if (count < least || count > most)
		return fail_at_line(obj->error, "mesh-bad-line", obj->line,
				    "%s has %u numbers, expected %u to %u; is the file truncated?", what, count, least,
				    most);
	return TW_OK;
}

static enum tw_status bad_corner(const struct obj *obj)
{
	return fail_at_line(obj->error, "mesh-bad-line", obj->line,
			    "a corner of a face is not of the form v, v/vt, v//vn or v/vt/vn");
}

/* An OBJ index counts from 1, or backwards from what was read so far. */
static enum tw_status read_index(struct obj *obj, struct text *word, const char *what, uint32_t so_far, uint32_t count,
				 uint32_t *index)
{
	int64_t number = 0;
	if (!text_take_integer(word, &number) || (word->at < word->end && *word->at != '/'))
		return bad_corner(obj);
	int64_t place = number < 0 ? (int64_t)so_far + number : number - 1;
	if (number == 0 || place < 0 || place >= count)
		return fail_at_line(obj->error, "mesh-bad-index", obj->line,
				    "%s index %lld is out of range: the file has %u", what, (long long)number, count);
	*index = (uint32_t)place;
	return TW_OK;
}

static bool take_slash(struct text *word)
{
	bool slash = word->at < word->end && *word->at == '/';
	word->at += slash;
	return slash;
}

/* What stands behind the second slash must be an index or nothing, though normals are not used. */
static bool is_normal_index(struct text word)
{
	int64_t ignored = 0;
	return word.at == word.end || (text_take_integer(&word, &ignored) && word.at == word.end);
}

/* One of v, v/vt, v//vn and v/vt/vn; slashes with nothing behind them (v//, v/vt/) say nothing. */
static enum tw_status read_corner(struct obj *obj, struct text word)
{
	struct soup *soup = obj->soup;
	bool has_coord = false;
	enum tw_status status =
		read_index(obj, &word, "vertex", obj->vertex, soup->vertex_count, &soup->corner_vertex[obj->corner]);
	if (status != TW_OK)
		return status;
	if (take_slash(&word)) {
		has_coord = word.at < word.end && *word.at != '/';
		if (has_coord)
			status = read_index(obj, &word, "texture coordinate", obj->coord, soup->coord_count,
					    &soup->corner_coord[obj->corner]);
		if (status != TW_OK)
			return status;
	}
	if (take_slash(&word) && !is_normal_index(word))
		return bad_corner(obj);
	if (obj->corner > 0 && has_coord != obj->has_coords)
		return fail_at_line(obj->error, "mesh-mixed-coords", obj->line,
				    "some corners have a texture coordinate and some have none; give one to every "
				    "corner, or to none and send the flat pattern separately");
	obj->has_coords = has_coord;
	obj->corner++;
	return TW_OK;
}

static enum tw_status read_face(struct obj *obj, struct text *line)
{
	struct soup *soup = obj->soup;
	uint32_t first = obj->corner;
	soup->polygon_start[obj->polygon] = first;
	soup->polygon_line[obj->polygon] = obj->line;
	for (int kind = 0; kind < LABEL_KINDS; kind++)
		soup->polygon_label[kind][obj->polygon] = obj->labels[kind] - 1; /* none yet: GARMENT_NONE */
	for (struct text word; text_next_word(line, &word);) {
		enum tw_status status = read_corner(obj, word);
		if (status != TW_OK)
			return status;
	}
	uint32_t corners = obj->corner - first;
	if (corners < 3 || corners > POLYGON_CORNERS)
		return fail_at_line(obj->error, "mesh-bad-face", obj->line,
				    "face %u has %u corner%s, expected 3 to %d; is the file truncated?", obj->polygon,
				    corners, corners == 1 ? "" : "s", POLYGON_CORNERS);
	obj->polygon++;
	return TW_OK;
}

/* A name that is no UTF-8 is one that nobody can be shown: the piece gets a number instead. */
static void read_label(struct obj *obj, enum label_kind kind, const struct text *line)
{
	struct text name = text_trimmed(*line);
	if (!text_is_utf8(&name)) {
		warning_add(&obj->report->warnings, "names-unreadable", "line", obj->line,
			    "names that are not UTF-8 text on one line were ignored");
		name.end = name.at;
	}
	obj->soup->label[kind][obj->labels[kind]++] = name;
}

static enum tw_status read_line(struct obj *obj, struct text line)
{
	struct soup *soup = obj->soup;
	struct text word;
	if (!text_next_word(&line, &word))
		return TW_OK;
	enum keyword keyword = keyword_of(&word);
	switch (keyword) {
	case LINE_VERTEX:
		return read_numbers(obj, &line, "v", 3, 7, 3, soup->position + 3 * (size_t)obj->vertex++);
	case LINE_COORD:
		return read_numbers(obj, &line, "vt", 2, 3, 2, soup->coord + 2 * (size_t)obj->coord++);
	case LINE_FACE:
		return read_face(obj, &line);
	case LINE_GROUP:
	case LINE_OBJECT:
	case LINE_MATERIAL:
		read_label(obj, label_of(keyword), &line);
		return TW_OK;
	case LINE_OTHER:
	case LINE_SKIPPED:
		break;
	}
	return TW_OK;
}

static int compare_labels(const void *a, const void *b, void *context)
{
	const struct text *labels = context, *x = &labels[*(const uint32_t *)a], *y = &labels[*(const uint32_t *)b];
	size_t x_size = (size_t)(x->end - x->at), y_size = (size_t)(y->end - y->at);
	int order = memcmp(x->at, y->at, x_size < y_size ? x_size : y_size);
	if (order != 0)
		return order;
	if (x_size != y_size)
		return x_size < y_size ? -1 : 1;
	return *(const uint32_t *)a < *(const uint32_t *)b ? -1 : 1;
}

/* Gives equal labels the number of the first of them, and the empty label none. */
static enum tw_status unite_labels(struct obj *obj, struct arena *arena, enum label_kind kind)
{
	struct soup *soup = obj->soup;
	struct text *labels = soup->label[kind];
	uint32_t count = obj->labels[kind], *polygon_label = soup->polygon_label[kind];
	struct arena_mark mark = arena_mark(arena);
	uint32_t *order = ARENA_ARRAY(arena, count, uint32_t), *first = ARENA_ARRAY(arena, count, uint32_t);
	if (!order || !first)
		return tw_fail_memory(obj->error);
	for (uint32_t i = 0; i < count; i++)
		order[i] = i;
	qsort_r(order, count, sizeof *order, compare_labels, labels);
	for (uint32_t i = 0; i < count; i++) {
		const struct text *label = &labels[order[i]], *before = i ? &labels[order[i - 1]] : NULL;
		size_t size = (size_t)(label->end - label->at);
		bool equal = before && (size_t)(before->end - before->at) == size &&
			     memcmp(before->at, label->at, size) == 0;
		first[order[i]] = size == 0 ? GARMENT_NONE : equal ? first[order[i - 1]] : order[i];
	}
	for (uint32_t p = 0; p < soup->polygon_count; p++) {
		if (polygon_label[p] != GARMENT_NONE)
			polygon_label[p] = first[polygon_label[p]];
	}
	arena_release(arena, mark);
	return TW_OK;
}

static enum tw_status fill(struct obj *obj, struct arena *arena)
{
	struct soup *soup = obj->soup;
	struct text line;
	for (uint32_t number = 0; obj_next_line(&obj->text, &line, &number);) {
		obj->line = number;
		enum tw_status status = read_line(obj, line);
		if (status != TW_OK)
			return status;
	}
	soup->polygon_start[soup->polygon_count] = obj->corner;
	if (!obj->has_coords)
		soup->corner_coord = NULL;
	enum tw_status status = TW_OK;
	for (int kind = 0; kind < LABEL_KINDS && status == TW_OK; kind++)
		status = unite_labels(obj, arena, kind);
	return status;
}

bool obj_line_is_geometry(struct text line)
{
	struct text word;
	if (!text_next_word(&line, &word))
		return false;
	enum keyword keyword = keyword_of(&word);
	return keyword == LINE_VERTEX || keyword == LINE_COORD || keyword == LINE_FACE;
}

enum tw_status obj_parse(struct soup *soup, struct arena *arena, struct text file, struct garment_report *report,
			 struct tw_error *error)
{
	*soup = (struct soup){0};
	text_skip_mark(&file);
	struct obj obj = {.soup = soup, .text = file, .report = report, .error = error};
	enum tw_status status = count_lines(&obj);
	if (status == TW_OK)
		status = allocate(&obj, arena);
	if (status == TW_OK)
		status = fill(&obj, arena);
	if (status == TW_OK)
		status = check_polygons(soup, error);
	return status;
}

enum tw_status obj_read(struct soup *soup, struct arena *arena, struct text file, struct garment_report *report,
			struct tw_error *error)
{
	enum tw_status status = obj_parse(soup, arena, file, report, error);
	return status == TW_OK ? openmesh_agrees(soup, file, MESH_OBJ, false, error) : status;
}
