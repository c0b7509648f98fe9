/* The strict reader of OFF: the ASCII form with three numbers a vertex and no colours. Comments and empty lines may
 * stand anywhere. */
#include "solver/garment/openmesh.h"
#include "solver/garment/soup.h"

struct off {
	struct text text;
	uint32_t line;
	uint64_t corner_capacity;
	struct soup *soup;
	struct tw_error *error;
};

bool off_is(struct text file)
{
	struct text word;
	return text_first_word(file, &word) && text_equals(&word, "off");
}

bool off_line_counts(struct text line)
{
	struct text word;
	return text_next_word(&line, &word);
}

/* The next line that says something. */
static bool next_line(struct off *off, struct text *line)
{
	while (text_next_line(&off->text, line, &off->line)) {
		if (off_line_counts(*line))
			return true;
	}
	return false;
}

static enum tw_status truncated(const struct off *off, const char *what, uint32_t number)
{
	return fail_at_line(off->error, "mesh-truncated", off->line, "%s %u is missing: the file ends before it", what,
			    number);
}

static enum tw_status read_counts(struct off *off)
{
	struct text line, word;
	int64_t counts[3] = {0};
	if (!next_line(off, &line) || !text_next_word(&line, &word) || !text_equals(&word, "off") ||
	    text_next_word(&line, &word))
		return tw_fail(off->error, TW_ERROR_UNSUPPORTED, "mesh-bad-header", "line 1",
			       "only plain ASCII OFF is read: a first line `OFF`, then `vertices faces edges`");
	if (!next_line(off, &line))
		return truncated(off, "the line of counts behind line", 1);
	for (int i = 0; i < 3; i++) {
		if (!text_next_word(&line, &word) || !text_take_integer(&word, &counts[i]) || word.at < word.end ||
		    counts[i] < 0)
			return fail_at_line(off->error, "mesh-bad-header", off->line,
					    "expected `vertices faces edges`");
	}
	if (text_next_word(&line, &word)) /* other readers take it for the first vertex */
		return fail_at_line(off->error, "mesh-bad-header", off->line,
				    "there is something behind `vertices faces edges`; begin a new line for the first "
				    "vertex");
	enum tw_status status = check_counts((uint64_t)counts[0], (uint64_t)counts[1], off->error);
	off->soup->vertex_count = (uint32_t)counts[0];
	off->soup->polygon_count = (uint32_t)counts[1];
	return status;
}

/* Arrays for what the header claims, where the rest of the file can hold it: six bytes a vertex, eight a triangle, two
 * a corner. */
static enum tw_status allocate(struct off *off, struct arena *arena)
{
	struct soup *soup = off->soup;
	uint64_t left = (uint64_t)(off->text.end - off->text.at), faces = soup->polygon_count;
	uint64_t needed = 6 * (uint64_t)soup->vertex_count + 8 * faces;
	if (needed > left + 1)
		return tw_fail(off->error, TW_ERROR_INPUT, "mesh-truncated", NULL,
			       "the header claims %u vertices and %u faces, at least %llu bytes; %llu follow",
			       soup->vertex_count, soup->polygon_count, (unsigned long long)needed,
			       (unsigned long long)left);
	off->corner_capacity = left / 2 < faces * POLYGON_CORNERS ? left / 2 : faces * POLYGON_CORNERS;
	soup->position = ARENA_ARRAY(arena, 3 * (size_t)soup->vertex_count, double);
	soup->polygon_start = ARENA_ZEROED(arena, faces + 1, uint32_t);
	soup->polygon_line = ARENA_ARRAY(arena, faces, uint32_t);
	soup->corner_vertex = ARENA_ARRAY(arena, off->corner_capacity, uint32_t);
	if (!soup->position || !soup->polygon_start || !soup->polygon_line || !soup->corner_vertex)
		return tw_fail_memory(off->error);
	return TW_OK;
}

static enum tw_status read_vertices(struct off *off)
{
	for (uint32_t v = 0; v < off->soup->vertex_count; v++) {
		struct text line, word;
		uint32_t numbers = 0;
		if (!next_line(off, &line))
			return truncated(off, "vertex", v);
		for (; text_next_word(&line, &word); numbers++) {
			double number = 0;
			if (!text_to_number(&word, &number))
				return fail_at_line(off->error, "mesh-not-a-number", off->line,
						    "vertex %u has a coordinate that is not a finite number", v);
			if (numbers < 3)
				off->soup->position[3 * (size_t)v + numbers] = number;
		}
		if (numbers != 3)
			return fail_at_line(off->error, "mesh-bad-line", off->line,
					    "vertex %u has %u numbers, expected 3; is the file truncated?", v, numbers);
	}
	return TW_OK;
}

static enum tw_status read_corners(struct off *off, struct text *line, uint32_t face, int64_t corners)
{
	struct soup *soup = off->soup;
	struct text word;
	for (int64_t k = 0; k < corners; k++) {
		int64_t index = 0;
		if (!text_next_word(line, &word) || !text_take_integer(&word, &index) || word.at < word.end)
			return fail_at_line(off->error, "mesh-bad-face", off->line,
					    "face %u has fewer than its %lld vertex indexes; is the file truncated?",
					    face, (long long)corners);
		if (index < 0 || index >= soup->vertex_count)
			return fail_at_line(off->error, "mesh-bad-index", off->line,
					    "vertex index %lld of face %u is out of range: the file has %u vertices",
					    (long long)index, face, soup->vertex_count);
		if (soup->corner_count == off->corner_capacity)
			return truncated(off, "face", face);
		soup->corner_vertex[soup->corner_count++] = (uint32_t)index;
	}
	if (text_next_word(line, &word))
		return fail_at_line(off->error, "mesh-bad-face", off->line,
				    "there is something behind the vertex indexes of face %u; export without colours",
				    face);
	return TW_OK;
}

static enum tw_status read_faces(struct off *off)
{
	struct soup *soup = off->soup;
	for (uint32_t f = 0; f < soup->polygon_count; f++) {
		struct text line, word;
		int64_t corners = 0;
		if (!next_line(off, &line))
			return truncated(off, "face", f);
		if (!text_next_word(&line, &word) || !text_take_integer(&word, &corners) || word.at < word.end ||
		    corners < 3 || corners > POLYGON_CORNERS)
			return fail_at_line(off->error, "mesh-bad-face", off->line,
					    "face %u does not begin with a number of corners from 3 to %d", f,
					    POLYGON_CORNERS);
		soup->polygon_line[f] = off->line;
		enum tw_status status = read_corners(off, &line, f, corners);
		if (status != TW_OK)
			return status;
		soup->polygon_start[f + 1] = soup->corner_count;
	}
	struct text line;
	if (next_line(off, &line))
		return fail_at_line(off->error, "mesh-trailing-bytes", off->line,
				    "there is something behind the last of %u faces; the header and the file disagree",
				    soup->polygon_count);
	return TW_OK;
}

enum tw_status off_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error)
{
	*soup = (struct soup){0};
	text_skip_mark(&file);
	struct off off = {.text = file, .soup = soup, .error = error};
	enum tw_status status = read_counts(&off);
	if (status == TW_OK)
		status = allocate(&off, arena);
	if (status == TW_OK)
		status = read_vertices(&off);
	if (status == TW_OK)
		status = read_faces(&off);
	if (status == TW_OK)
		status = check_polygons(soup, error);
	if (status == TW_OK)
		status = openmesh_agrees(soup, file, MESH_OFF, false, error);
	return status;
}
