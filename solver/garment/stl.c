/* The strict check of STL, ASCII and binary, before OpenMesh reads it. It is binary where the count of triangles fits
 * the size, whatever its first word says. */
#include "solver/garment/openmesh.h"
#include "solver/garment/soup.h"

#include <math.h>
#include <string.h>

enum { HEADER_BYTES = 84, TRIANGLE_BYTES = 50 };

static bool starts_with_solid(struct text file)
{
	return file.end - file.at >= 5 && memcmp(file.at, "solid", 5) == 0;
}

static uint32_t claimed_triangles(struct text file)
{
	uint32_t count = 0;
	for (int i = 3; i >= 0; i--)
		count = count << 8 | (unsigned char)file.at[80 + i];
	return count;
}

static bool is_binary(struct text file)
{
	size_t size = (size_t)(file.end - file.at);
	return size >= HEADER_BYTES && HEADER_BYTES + (uint64_t)TRIANGLE_BYTES * claimed_triangles(file) == size;
}

bool stl_is(struct text file)
{
	return is_binary(file) || starts_with_solid(file);
}

static enum tw_status check_triangle(const float *corner, uint32_t triangle, struct tw_error *error)
{
	char where[32];
	snprintf(where, sizeof where, "face %u", triangle);
	for (int i = 0; i < 9; i++) {
		if (!isfinite(corner[i]))
			return tw_fail(error, TW_ERROR_INPUT, "mesh-not-a-number", where,
				       "face %u has a coordinate that is not a finite number", triangle);
	}
	for (int k = 0; k < 3; k++) {
		const float *a = corner + 3 * k, *b = corner + 3 * ((k + 1) % 3);
		if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2])
			return tw_fail(error, TW_ERROR_INPUT, "mesh-degenerate-face", where,
				       "face %u has two corners at the same place; delete the face", triangle);
	}
	return TW_OK;
}

static enum tw_status walk_binary(struct text file, uint32_t triangles, struct tw_error *error)
{
	for (uint32_t t = 0; t < triangles; t++) {
		const unsigned char *at =
			(const unsigned char *)file.at + HEADER_BYTES + (size_t)TRIANGLE_BYTES * t + 12;
		float corner[9];
		for (int i = 0; i < 9; i++, at += 4) {
			uint32_t bits =
				(uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
			memcpy(&corner[i], &bits, sizeof bits);
		}
		enum tw_status status = check_triangle(corner, t, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* The lines of a triangle, in order; what follows the first words of the first one is its normal. */
static const char *const triangle_lines[] = {"facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
enum { TRIANGLE_LINES = 7 };

static enum tw_status read_vertex(struct text line, uint32_t number, float *corner, struct tw_error *error)
{
	struct text word;
	for (int axis = 0; axis < 3; axis++) {
		double value = 0;
		if (!text_next_word(&line, &word) || !text_to_number(&word, &value) || fabs(value) > 3e38)
			return fail_at_line(error, "mesh-not-a-number", number,
					    "expected `vertex x y z` with finite numbers");
		corner[axis] = (float)value;
	}
	if (text_next_word(&line, &word))
		return fail_at_line(error, "mesh-bad-line", number, "there is something behind `vertex x y z`");
	return TW_OK;
}

static enum tw_status walk_text(struct text file, uint32_t *triangles, struct tw_error *error)
{
	struct text line, word;
	uint32_t number = 0;
	int state = 0;
	float corner[9];
	*triangles = 0;
	while (text_next_line(&file, &line, &number)) {
		if (!text_next_word(&line, &word))
			continue;
		if (state == 0 && (text_equals(&word, "solid") || text_equals(&word, "endsolid")))
			continue;
		if (!text_equals(&word, triangle_lines[state]))
			return fail_at_line(error, "mesh-bad-line", number, "expected a line that begins with `%s`",
					    triangle_lines[state]);
		enum tw_status status = TW_OK;
		if (state >= 2 && state <= 4)
			status = read_vertex(line, number, corner + 3 * (size_t)(state - 2), error);
		state = (state + 1) % TRIANGLE_LINES;
		if (status == TW_OK && state == 0)
			status = check_triangle(corner, (*triangles)++, error);
		if (status != TW_OK)
			return status;
	}
	if (state != 0)
		return fail_at_line(error, "mesh-truncated", number, "the file ends within face %u", *triangles);
	return TW_OK;
}

enum tw_status stl_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error)
{
	bool binary = is_binary(file);
	if (!binary && !starts_with_solid(file)) {
		bool has_header = file.end - file.at >= HEADER_BYTES;
		return tw_fail(
			error, TW_ERROR_INPUT, "mesh-truncated", NULL,
			"the file is neither ASCII STL nor binary STL of the right size: it claims %u faces and has "
			"%zu bytes",
			has_header ? claimed_triangles(file) : 0, (size_t)(file.end - file.at));
	}
	uint32_t triangles = binary ? claimed_triangles(file) : 0;
	enum tw_status status = binary ? check_counts(0, triangles, error) : walk_text(file, &triangles, error);
	if (status == TW_OK && binary)
		status = walk_binary(file, triangles, error);
	if (status == TW_OK)
		status = check_counts(0, triangles, error);
	if (status == TW_OK)
		status = openmesh_read(soup, arena, file, MESH_STL, binary, 0, triangles, error);
	if (status == TW_OK)
		status = check_counts(soup->vertex_count, 0, error);
	return status;
}
