/* The strict reader of STL, ASCII and binary. It is binary where the count of triangles fits the size, whatever its
 * first word says. STL has no shared vertices: corners are sorted by position, equal ones are one vertex, and vertices
 * are numbered in the order in which triangles first use them. */
#include "solver/garment/openmesh.h"
#include "solver/garment/soup.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_BYTES = 84, TRIANGLE_BYTES = 50 };

static bool starts_with_solid(struct text file)
{
	struct text word;
	return text_first_word(file, &word) && text_equals(&word, "solid");
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

/* corner: [triangles][3][3], to fill. */
static enum tw_status read_binary(struct text file, uint32_t triangles, float *corner, struct tw_error *error)
{
	const unsigned char *at = (const unsigned char *)file.at + HEADER_BYTES;
	for (uint32_t t = 0; t < triangles; t++, at += TRIANGLE_BYTES, corner += 9) {
		for (int i = 0; i < 9; i++) {
			const unsigned char *number = at + 12 + 4 * i; /* behind the normal */
			uint32_t bits = (uint32_t)number[0] | (uint32_t)number[1] << 8 | (uint32_t)number[2] << 16 |
					(uint32_t)number[3] << 24;
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

/* Triangles at most: a text has more than 60 bytes for each. */
static uint32_t most_triangles(struct text file)
{
	size_t triangles = (size_t)(file.end - file.at) / 60 + 1;
	return triangles < TW_LIMIT_FACES ? (uint32_t)triangles : TW_LIMIT_FACES;
}

/* corner: [limit][3][3], to fill. */
static enum tw_status read_text(struct text file, uint32_t limit, float *corner, uint32_t *triangles,
				struct tw_error *error)
{
	struct text line, word;
	uint32_t number = 0;
	int state = 0;
	text_skip_mark(&file);
	*triangles = 0;
	while (text_next_line(&file, &line, &number)) {
		if (!text_next_word(&line, &word))
			continue;
		if (state == 0 && (text_equals(&word, "solid") || text_equals(&word, "endsolid")))
			continue;
		if (!text_equals(&word, triangle_lines[state]))
			return fail_at_line(error, "mesh-bad-line", number, "expected a line that begins with `%s`",
					    triangle_lines[state]);
		if (*triangles == limit)
			return check_counts(0, (uint64_t)TW_LIMIT_FACES + 1, error);
		float *here = corner + 9 * (size_t)*triangles;
		enum tw_status status = TW_OK;
		if (state >= 2 && state <= 4)
			status = read_vertex(line, number, here + 3 * (size_t)(state - 2), error);
		state = (state + 1) % TRIANGLE_LINES;
		if (status == TW_OK && state == 0)
			status = check_triangle(here, (*triangles)++, error);
		if (status != TW_OK)
			return status;
	}
	if (state != 0)
		return fail_at_line(error, "mesh-truncated", number, "the file ends within face %u", *triangles);
	return TW_OK;
}

/* By position, then by number. */
static int compare_corners(const void *a, const void *b, void *context)
{
	uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
	const float *p = (const float *)context + 3 * (size_t)i, *q = (const float *)context + 3 * (size_t)j;
	for (int axis = 0; axis < 3; axis++) {
		if (p[axis] != q[axis])
			return p[axis] < q[axis] ? -1 : 1;
	}
	return (i > j) - (i < j);
}

/* vertex[corner] becomes the first corner at the same place. */
static enum tw_status find_first(struct arena *arena, float *corner, uint32_t count, uint32_t *vertex,
				 struct tw_error *error)
{
	struct arena_mark mark = arena_mark(arena);
	uint32_t *order = ARENA_ARRAY(arena, count, uint32_t);
	if (!order)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < count; i++)
		order[i] = i;
	qsort_r(order, count, sizeof *order, compare_corners, corner);
	for (uint32_t i = 0; i < count; i++) {
		const float *p = corner + 3 * (size_t)order[i], *q = i ? corner + 3 * (size_t)order[i - 1] : NULL;
		bool same = q && p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
		vertex[order[i]] = same ? vertex[order[i - 1]] : order[i];
	}
	arena_release(arena, mark);
	return TW_OK;
}

static enum tw_status make_soup(struct soup *soup, struct arena *arena, float *corner, uint32_t triangles,
				struct tw_error *error)
{
	const uint32_t count = 3 * triangles;
	soup->polygon_count = triangles;
	soup->corner_count = count;
	soup->polygon_start = ARENA_ARRAY(arena, (size_t)triangles + 1, uint32_t);
	soup->corner_vertex = ARENA_ARRAY(arena, count, uint32_t);
	soup->position = ARENA_ARRAY(arena, 3 * (size_t)count, double);
	if (!soup->polygon_start || !soup->corner_vertex || !soup->position)
		return tw_fail_memory(error);
	uint32_t *vertex = soup->corner_vertex;
	enum tw_status status = find_first(arena, corner, count, vertex, error);
	if (status != TW_OK)
		return status;
	for (uint32_t i = 0; i < count; i++) {
		if (vertex[i] < i) {
			vertex[i] = vertex[vertex[i]]; /* the first corner has its number already */
			continue;
		}
		for (size_t axis = 0; axis < 3; axis++)
			soup->position[3 * (size_t)soup->vertex_count + axis] = (double)corner[3 * (size_t)i + axis];
		vertex[i] = soup->vertex_count++;
	}
	for (uint32_t t = 0; t <= triangles; t++)
		soup->polygon_start[t] = 3 * t;
	return check_counts(soup->vertex_count, 0, error);
}

enum tw_status stl_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error)
{
	*soup = (struct soup){0};
	bool binary = is_binary(file);
	if (!binary && !starts_with_solid(file)) {
		bool has_header = file.end - file.at >= HEADER_BYTES;
		return tw_fail(
			error, TW_ERROR_INPUT, "mesh-truncated", NULL,
			"the file is neither ASCII STL nor binary STL of the right size: it claims %u faces and has "
			"%zu bytes",
			has_header ? claimed_triangles(file) : 0, (size_t)(file.end - file.at));
	}
	uint32_t triangles = binary ? claimed_triangles(file) : most_triangles(file);
	enum tw_status status = check_counts(0, triangles, error);
	if (status != TW_OK)
		return status;
	float *corner = ARENA_ARRAY(arena, 9 * (size_t)triangles, float);
	if (!corner)
		return tw_fail_memory(error);
	status = binary ? read_binary(file, triangles, corner, error)
			: read_text(file, triangles, corner, &triangles, error);
	if (status == TW_OK)
		status = make_soup(soup, arena, corner, triangles, error);
	if (status == TW_OK)
		status = openmesh_agrees(soup, file, MESH_STL, binary, error);
	return status;
}
