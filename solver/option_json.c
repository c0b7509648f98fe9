#include "solver/option_json.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

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

/* What the parser calls invalid though JSON allows it, and what no parser could read, in words that say what to do.
 * NULL: broken grammar, where the parser's own words name what it expected. */
static const char *say(enum json_error_code code)
{
	switch (code) {
	case json_error_null_character:
	case json_error_null_byte_in_key:
		return "no text here may hold the character NUL (\\u0000)";
	case json_error_numeric_overflow:
		return "this number is too large";
	case json_error_invalid_utf8:
		return "these bytes are not UTF-8; send UTF-8";
	case json_error_premature_end_of_input:
		return "the JSON ends too early; something is not closed";
	default:
		return NULL;
	}
}

/* One that is well formed but asks for what cannot be is a wrong value. */
static bool is_value(enum json_error_code code)
{
	return code == json_error_null_character || code == json_error_null_byte_in_key ||
	       code == json_error_numeric_overflow;
}

/* No JSON holds a NUL byte, but every ASCII character of UTF-16 and UTF-32 is one with such bytes. */
static enum tw_status check_encoding(const char *bytes, size_t size, struct tw_error *error)
{
	const char *nul = memchr(bytes, 0, size);
	char where[32];
	if (!nul)
		return TW_OK;
	snprintf(where, sizeof where, "byte %td", nul - bytes);
	return tw_fail(error, TW_ERROR_INPUT, "json-malformed", where,
		       "the JSON holds NUL bytes, as UTF-16 does; send UTF-8");
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
	enum json_error_code code = json_error_code(&trouble);
	const char *words = say(code);
	return tw_fail(error, TW_ERROR_INPUT, is_value(code) ? "json-value" : "json-malformed", where, "%s%s",
		       words ? "" : "not valid JSON: ", words ? words : trouble.text);
}

static json_t *whole_of(const json_t *value)
{
	double number = json_real_value(value);
	bool is_whole = json_is_real(value) && number == trunc(number) && fabs(number) <= 0x1p53;
	return is_whole ? json_integer((json_int_t)number) : NULL;
}

/* 5.0 and 5e0 are the integer 5: JSON has one kind of number (RFC 8259, 6), and some languages write no other. */
static void make_whole(json_t *value)
{
	const char *name;
	json_t *item, *whole;
	size_t i;
	void *next;
	json_object_foreach_safe(value, next, name, item)
	{
		make_whole(item);
		whole = whole_of(item);
		if (whole && json_object_set_new(value, name, whole))
			return;
	}
	json_array_foreach(value, i, item)
	{
		make_whole(item);
		whole = whole_of(item);
		if (whole && json_array_set_new(value, i, whole))
			return;
	}
}

/* Some editors put a byte order mark before UTF-8; a reader may ignore it (RFC 8259, 8.1). */
static void skip_mark(const char **bytes, size_t *size)
{
	if (*size < 3 || memcmp(*bytes, "\xEF\xBB\xBF", 3) != 0)
		return;
	*bytes += 3;
	*size -= 3;
}

enum tw_status option_json_parse_as_written(json_t **object, const char *bytes, size_t size, struct tw_error *error)
{
	*object = NULL;
	if (size > TW_LIMIT_JSON_BYTES)
		return tw_fail(error, TW_ERROR_LIMIT, "json-too-large", NULL, "the JSON has %zu bytes, more than %u",
			       size, TW_LIMIT_JSON_BYTES);
	skip_mark(&bytes, &size);
	if (size == 0)
		return tw_fail(error, TW_ERROR_INPUT, "json-malformed", NULL, "the JSON is empty; send an object");
	enum tw_status status = check_encoding(bytes, size, error);
	if (status == TW_OK)
		status = check_depth(bytes, size, error);
	if (status == TW_OK)
		status = load(object, bytes, size, error);
	if (status == TW_OK && !json_is_object(*object)) {
		json_decref(*object);
		*object = NULL;
		status = tw_fail(error, TW_ERROR_INPUT, "json-type", NULL, "the JSON must be an object");
	}
	return status;
}

enum tw_status option_json_parse(json_t **object, const char *bytes, size_t size, struct tw_error *error)
{
	enum tw_status status = option_json_parse_as_written(object, bytes, size, error);
	if (status == TW_OK)
		make_whole(*object);
	return status;
}
