/* The strict check of OFF before OpenMesh reads it: the ASCII form with three numbers a vertex and no colours.
 * Comments and empty lines may stand anywhere. */
#include "solver/garment/openmesh.h"
#include "solver/garment/soup.h"

#include <math.h>
#include <string.h>

struct off {
	struct text text;
	uint32_t line;
	uint32_t vertex_count, face_count;
	struct tw_error *error;
};

bool off_is(struct text file)
{
	return file.end - file.at >= 3 && memcmp(file.at, "OFF", 3) == 0;
}

bool off_line_counts(struct text line)
{
	struct text word;
	return text_next_word(&line, &word) && *word.at != '#';
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
	if (!next_line(off, &line) || !text_next_word(&line, &word) || !text_equals(&word, "OFF") ||
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
	off->vertex_count = (uint32_t)counts[0];
	off->face_count = (uint32_t)counts[1];
	return check_counts((uint64_t)counts[0], (uint64_t)counts[1], off->error);
}

static enum tw_status walk_vertices(struct off *off)
{
	for (uint32_t v = 0; v < off->vertex_count; v++) {
		struct text line, word;
		uint32_t numbers = 0;
		if (!next_line(off, &line))
			return truncated(off, "vertex", v);
		for (; text_next_word(&line, &word); numbers++) {
			double number = 0;
			if (!text_to_number(&word, &number) || fabs(number) > 3e38)
				return fail_at_line(off->error, "mesh-not-a-number", off->line,
						    "vertex %u has a coordinate that is not a finite number", v);
		}
		if (numbers != 3)
			return fail_at_line(off->error, "mesh-bad-line", off->line,
					    "vertex %u has %u numbers, expected 3; is the file truncated?", v, numbers);
	}
	return TW_OK;
}

static enum tw_status walk_faces(struct off *off)
{
	for (uint32_t f = 0; f < off->face_count; f++) {
		struct text line, word;
		int64_t corners = 0, index = 0;
		if (!next_line(off, &line))
			return truncated(off, "face", f);
		if (!text_next_word(&line, &word) || !text_take_integer(&word, &corners) || word.at < word.end ||
		    corners < 3 || corners > POLYGON_CORNERS)
			return fail_at_line(off->error, "mesh-bad-face", off->line,
					    "face %u does not begin with a number of corners from 3 to %d", f,
					    POLYGON_CORNERS);
		for (int64_t k = 0; k < corners; k++) {
			if (!text_next_word(&line, &word) || !text_take_integer(&word, &index) || word.at < word.end)
				return fail_at_line(
					off->error, "mesh-bad-face", off->line,
					"face %u has fewer than its %lld vertex indexes; is the file truncated?", f,
					(long long)corners);
			if (index < 0 || index >= off->vertex_count)
				return fail_at_line(
					off->error, "mesh-bad-index", off->line,
					"vertex index %lld of face %u is out of range: the file has %u vertices",
					(long long)index, f, off->vertex_count);
		}
		if (text_next_word(&line, &word))
			return fail_at_line(
				off->error, "mesh-bad-face", off->line,
				"there is something behind the vertex indexes of face %u; export without colours", f);
	}
	return TW_OK;
}

enum tw_status off_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error)
{
	struct off off = {.text = file, .error = error};
	enum tw_status status = read_counts(&off);
	if (status == TW_OK)
		status = walk_vertices(&off);
	if (status == TW_OK)
		status = walk_faces(&off);
	if (status == TW_OK)
		status = openmesh_read(soup, arena, file, MESH_OFF, false, off.vertex_count, off.face_count, error);
	if (status == TW_OK)
		status = check_polygons(soup, error);
	return status;
}
