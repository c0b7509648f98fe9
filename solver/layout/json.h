/* Values of a request's JSON, checked: every failure is TW_ERROR_INPUT with `where`, a JSON Pointer, as its place. */
#ifndef SOLVER_LAYOUT_JSON_H
#define SOLVER_LAYOUT_JSON_H

#include "tightwire.h"

#include <jansson.h>

/* A copy of a text that is fit to be printed: not empty, not too long, without control characters. The caller's to
 * free. */
enum tw_status json_read_text(char **text, const json_t *value, const char *where, struct tw_error *error) TW_NODISCARD;

/* A whole number below UINT32_MAX. */
enum tw_status json_read_index(uint32_t *index, const json_t *value, const char *where,
			       struct tw_error *error) TW_NODISCARD;

/* An array of `count` finite numbers within a million. */
enum tw_status json_read_numbers(double *numbers, size_t count, const json_t *value, const char *where,
				 struct tw_error *error) TW_NODISCARD;

#endif
