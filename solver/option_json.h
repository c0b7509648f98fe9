/* JSON that comes from outside, strictly: bounded in size and depth before anything is built from it, a member only
 * once. A byte order mark before it is skipped; numbers without a fraction become integers, however they were written.
 */
#ifndef SOLVER_OPTION_JSON_H
#define SOLVER_OPTION_JSON_H

#include "tightwire.h"

#include <jansson.h>

/* Parses one JSON object; *object is the caller's. TW_ERROR_LIMIT "json-too-large" above TW_LIMIT_JSON_BYTES,
 * TW_ERROR_INPUT "json-too-deep" above TW_LIMIT_JSON_DEPTH, "json-malformed" with line and column, "json-type" for what
 * is no object. */
enum tw_status option_json_parse(json_t **object, const char *bytes, size_t size, struct tw_error *error) TW_NODISCARD;

/* The same, with every number as it was written: for comparing requests with those of other releases. */
enum tw_status option_json_parse_as_written(json_t **object, const char *bytes, size_t size,
					    struct tw_error *error) TW_NODISCARD;

#endif
