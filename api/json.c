#include "api/json.h"

#include "solver/option.h"

#include <string.h>
#include <time.h>

/* Deepest nesting, counted outside of strings. jansson would recurse that deep before it could tell. */
static unsigned nesting(const char *bytes, size_t size)
{
	unsigned depth = 0, deepest = 0;
	bool quoted = false;
	for (size_t i = 0; i < size; i++) {
		char c = bytes[i];
		if (quoted) {
			i += c == '\\';
			quoted = c != '"';
		} else if (c == '"') {
			quoted = true;
		} else if (c == '{' || c == '[') {
			if (++depth > deepest)
				deepest = depth;
		} else if ((c == '}' || c == ']') && depth) {
			depth--;
		}
	}
	return deepest;
}

enum tw_status json_parse_object(const char *bytes, size_t size, json_t **object, struct tw_error *error)
{
	*object = NULL;
	if (size > TW_LIMIT_JSON_BYTES)
		return tw_fail(error, TW_ERROR_LIMIT, "json-too-large", NULL, "the JSON is larger than %u bytes",
			       TW_LIMIT_JSON_BYTES);
	if (nesting(bytes, size) > TW_LIMIT_JSON_DEPTH)
		return tw_fail(error, TW_ERROR_INPUT, "json-too-deep", NULL, "the JSON is nested deeper than %u levels",
			       TW_LIMIT_JSON_DEPTH);
	if (size == 0)
		return tw_fail(error, TW_ERROR_INPUT, "json-malformed", NULL, "the body is empty; send a JSON object");
	json_error_t detail;
	json_t *value = json_loadb(bytes, size, JSON_REJECT_DUPLICATES, &detail);
	if (!value && json_error_code(&detail) == json_error_out_of_memory)
		return tw_fail_memory(error);
	if (!value) {
		char where[64];
		snprintf(where, sizeof where, "line %d, column %d", detail.line, detail.column);
		return tw_fail(error, TW_ERROR_INPUT, "json-malformed", where, "the body is not JSON: %s", detail.text);
	}
	if (!json_is_object(value)) {
		json_decref(value);
		return tw_fail(error, TW_ERROR_INPUT, "json-type", NULL, "the body must be a JSON object");
	}
	*object = value;
	return TW_OK;
}

json_t *json_embed(const char *text)
{
	json_t *value = text && *text ? json_loads(text, JSON_DECODE_ANY, NULL) : NULL;
	return value ? value : json_null();
}

bool json_is_text(const char *text)
{
	json_t *string = json_string(text);
	json_decref(string);
	return string;
}

json_t *json_time(int64_t time_ms)
{
	if (!time_ms)
		return json_null();
	time_t seconds = (time_t)(time_ms / 1000);
	struct tm parts;
	char text[48];
	gmtime_r(&seconds, &parts);
	size_t length = strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
	snprintf(text + length, sizeof text - length, ".%03dZ", (int)(time_ms % 1000));
	return json_string(text);
}

enum tw_status json_get_text(const json_t *object, const char *name, bool required, const char **text,
			     struct tw_error *error)
{
	json_t *value = json_object_get(object, name);
	*text = json_string_value(value);
	if ((!value && !required) || *text)
		return TW_OK;
	char pointer[64];
	snprintf(pointer, sizeof pointer, "/%s", name);
	return tw_fail(error, TW_ERROR_INPUT, value ? "json-type" : "json-missing-field", pointer,
		       value ? "%s must be a string" : "%s is missing; give a string", name);
}

enum tw_status json_check_members(const json_t *object, const char *pointer, const char *const *known,
				  struct tw_error *error)
{
	const char *name = NULL;
	json_t *value = NULL;
	json_object_foreach((json_t *)object, name, value)
	{
		const char *const *k = known;
		while (*k && strcmp(*k, name) != 0)
			k++;
		char where[128];
		option_pointer(where, sizeof where, pointer, name);
		if (!*k)
			return tw_fail(error, TW_ERROR_INPUT, "json-unknown-field", where,
				       "there is no field of this name here; leave it out");
	}
	return TW_OK;
}
