/* Pieces of JSON that requests and responses share. */
#ifndef API_JSON_H
#define API_JSON_H

#include "tightwire.h"

#include <jansson.h>
#include <stdbool.h>

/* A stored JSON text as a value; null when it is NULL, empty or (which would be our bug) does not parse. */
json_t *json_embed(const char *text) TW_NODISCARD;

/* Whether bytes are UTF-8, which is what JSON can say. */
bool json_is_text(const char *text);

/* Milliseconds since 1970 as "2026-03-01T12:00:00.123Z"; null for 0. */
json_t *json_time(int64_t time_ms) TW_NODISCARD;

/* The words of a list with commas, as an array of strings. */
json_t *json_words(const char *list) TW_NODISCARD;

/* The string member `name`, borrowed from the object; *text is NULL where it is absent and not required. */
enum tw_status json_get_text(const json_t *object, const char *name, bool required, const char **text,
			     struct tw_error *error) TW_NODISCARD;

/* The member "name", what a user calls a thing (solver/names.h); NULL where it is not given. Borrowed. */
enum tw_status json_get_name(const json_t *object, const char **name, struct tw_error *error) TW_NODISCARD;

/* Fails on a member that is not among `known` (NULL-terminated), with its JSON Pointer below `pointer`. */
enum tw_status json_check_members(const json_t *object, const char *pointer, const char *const *known,
				  struct tw_error *error) TW_NODISCARD;

#endif
