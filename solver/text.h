/* Text that grows: what the writers of JSON and SVG write into. Failure sticks, so that a writer need not look after
 * every line: text_take says at the end whether all of it is there. Numbers are written the same on every machine. */
#ifndef SOLVER_TEXT_H
#define SOLVER_TEXT_H

#include "solver/arena.h"

#include <stdbool.h>

struct text {
	char *bytes; /* owned */
	size_t size, capacity;
	bool failed;
};

/* Starts as {0}. */
void text_add(struct text *text, const char *string);
TW_PRINTF(2, 3) void text_format(struct text *text, const char *format, ...);

/* With at most `decimals` decimals, without zeros behind; what is not finite is `null`. */
void text_number(struct text *text, double value, int decimals);

/* A whole number; text_format's "%ld" in a tenth of the time, for writers of many. */
void text_integer(struct text *text, long value);

/* A JSON string with its quotes. */
void text_json(struct text *text, const char *string);

/* XML character data, fit for an attribute too. */
void text_xml(struct text *text, const char *string);

/* Copies the text, with a NUL behind it, into the arena and frees its own. TW_ERROR_MEMORY. */
enum tw_status text_take(struct text *text, struct arena *arena, const char **bytes, size_t *size,
			 struct tw_error *error) TW_NODISCARD;

void text_clear(struct text *text);

#endif
