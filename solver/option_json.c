#include "solver/option_json.h"

#include <stdbool.h>

/* Nesting is counted on the raw bytes: a parser that recurses must not meet more than it can bear. */
static enum tw_status check_depth(const char *bytes, size_t size, struct tw_error *error)
{
	unsigned depth = 0;
	bool in_string = false;
	for (size_t i = 0; i < size; i++) {
		char c = bytes[i];
		if (in_string && c == '\\') {
			i++;
		} else if (c == '"') {
			in_string = !in_string;
		} else if (!in_string && (c == '[' || c == '{')) {
			if (++depth > TW_LIMIT_JSON_DEPTH) {
				char where[32];
				snprintf(where, sizeof where, "byte %zu", i);
				return tw_fail(error, TW_ERROR_INPUT, "json-too-deep", where,
					       "the JSON nests deeper than %u levels", TW_LIMIT_JSON_DEPTH);
			}
		} else if (!in_string && (c == ']' || c == '}') && depth > 0) {
			depth--;
		}
	}
	return TW_OK;
}

static enum tw_status load(json_t **root, const char *bytes, size_t size, struct tw_error *error)
{
	json_error_t trouble;
	*root = json_loadb(bytes, size, JSON_REJECT_DUPLICATES, &trouble);
	if (*root)
		return TW_OK;
	if (json_error_code(&trouble) == json_error_out_of_memory)
		return tw_fail_memory(error);
	char where[64];
	snprintf(where, sizeof where, "line %d column %d", trouble.line, trouble.column);
	return tw_fail(error, TW_ERROR_INPUT, "json-malformed", where, "not valid JSON: %s", trouble.text);
}

enum tw_status option_json_parse(json_t **object, const char *bytes, size_t size, struct tw_error *error)
{
	*object = NULL;
	if (size > TW_LIMIT_JSON_BYTES)
		return tw_fail(error, TW_ERROR_LIMIT, "json-too-large", NULL, "the JSON has %zu bytes, more than %u",
			       size, TW_LIMIT_JSON_BYTES);
	if (size == 0)
		return tw_fail(error, TW_ERROR_INPUT, "json-malformed", NULL, "the JSON is empty; send an object");
	enum tw_status status = check_depth(bytes, size, error);
	if (status == TW_OK)
		status = load(object, bytes, size, error);
	if (status == TW_OK && !json_is_object(*object)) {
		json_decref(*object);
		*object = NULL;
		status = tw_fail(error, TW_ERROR_INPUT, "json-type", NULL, "the JSON must be an object");
	}
	return status;
}
