#include "solver/garment/soup.h"

#include <string.h>

enum tw_status fail_at_line(struct tw_error *error, const char *type, uint32_t line, const char *format, ...)
{
	char where[32];
	snprintf(where, sizeof where, "line %u", line);
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(error, TW_ERROR_INPUT, type, where, format, arguments);
	va_end(arguments);
	return TW_ERROR_INPUT;
}

enum tw_status check_counts(uint64_t vertices, uint64_t polygons, struct tw_error *error)
{
	if (vertices > TW_LIMIT_VERTICES)
		return tw_fail(error, TW_ERROR_LIMIT, "mesh-too-large", NULL,
			       "the file has or claims %llu vertices; at most %u are accepted",
			       (unsigned long long)vertices, TW_LIMIT_VERTICES);
	if (polygons > TW_LIMIT_FACES)
		return tw_fail(error, TW_ERROR_LIMIT, "mesh-too-large", NULL,
			       "the file has or claims %llu faces; at most %u are accepted",
			       (unsigned long long)polygons, TW_LIMIT_FACES);
	return TW_OK;
}

static bool has_double(const uint32_t *vertices, uint32_t count, uint32_t *vertex)
{
	for (uint32_t i = 1; i < count; i++) {
		for (uint32_t j = 0; j < i; j++) {
			if (vertices[i] == vertices[j]) {
				*vertex = vertices[i];
				return true;
			}
		}
	}
	return false;
}

enum tw_status check_polygons(const struct soup *soup, struct tw_error *error)
{
	for (uint32_t p = 0; p < soup->polygon_count; p++) {
		const uint32_t *start = soup->polygon_start + p;
		uint32_t vertex = 0;
		if (!has_double(soup->corner_vertex + start[0], start[1] - start[0], &vertex))
			continue;
		char where[64];
		if (soup->polygon_line)
			snprintf(where, sizeof where, "line %u", soup->polygon_line[p]);
		else
			snprintf(where, sizeof where, "face %u", p);
		return tw_fail(error, TW_ERROR_INPUT, "mesh-degenerate-face", where,
			       "face %u has vertex %u twice; delete the face or give it three different vertices", p,
			       vertex);
	}
	return TW_OK;
}
