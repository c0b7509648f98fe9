/* Warnings: what is harmless and yet should be said aloud. A list of them travels with a result. */
#ifndef SOLVER_WARNING_H
#define SOLVER_WARNING_H

#include "tightwire.h"

#include <jansson.h>

enum { WARNINGS_MAX = 16, WARNING_PLACES = 8, WARNING_TEXT_BYTES = 320 };

struct warning {
	const char *type;               /* static slug: "isolated-vertices" */
	const char *place_kind;         /* static: "vertex", "face", "line", "piece", "frame", "terminal",
						   "branch"; "" for none */
	uint64_t count;                 /* how many places in all */
	uint32_t place[WARNING_PLACES]; /* the first of them; numbers of the uploaded file from 0, lines from 1 */
	uint32_t place_count;
	char text[WARNING_TEXT_BYTES]; /* one sentence */
};

/* At most one of a type; starts as zeros. */
struct warning_list {
	struct warning warning[WARNINGS_MAX];
	uint32_t count;
};

/* Counts one more place of a warning; the first call for a type writes its text. */
TW_PRINTF(5, 6)
void warning_add(struct warning_list *list, const char *type, const char *place_kind, uint32_t place,
		 const char *format, ...);

/* A warning of the whole, without a place. */
TW_PRINTF(3, 4)
void warning_add_whole(struct warning_list *list, const char *type, const char *format, ...);

/* [{"type", "count", "place_kind", "places", "text"}, …]; a new reference, NULL when out of memory. */
json_t *warning_list_show(const struct warning_list *list) TW_NODISCARD;

#endif
