#include "api/query.h"

#include "api/json.h"
#include "solver/names.h"

#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static enum tw_status fail_query(struct tw_error *error, const char *name, const char *text)
{
	return tw_fail(error, TW_ERROR_INPUT, "malformed-query", name, "%s", text);
}

static int hex_digit(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	c = (char)tolower((unsigned char)c);
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Decodes in place. The error is a sentence, NULL where there is none. */
static const char *decode(char *text)
{
	char *out = text;
	for (const char *p = text; *p; p++) {
		if (*p == '+') {
			*out++ = ' ';
		} else if (*p == '%') {
			int high = hex_digit(p[1]), low = high < 0 ? -1 : hex_digit(p[2]);
			if (low < 0)
				return "a percent escape in the query is broken; write %XX with two hexadecimal digits";
			if (high == 0 && low == 0)
				return "the query holds the character NUL (%00), which no parameter may";
			*out++ = (char)(high * 16 + low);
			p += 2;
		} else {
			*out++ = *p;
		}
	}
	*out = 0;
	return NULL;
}

static enum tw_status add_pair(struct query *query, char *text, struct tw_error *error)
{
	char *equals = strchr(text, '=');
	const char *value = "";
	if (equals) {
		*equals = 0;
		value = equals + 1;
	}
	const char *trouble = decode(text);
	if (trouble)
		return fail_query(error, NULL, trouble);
	trouble = equals ? decode(equals + 1) : NULL;
	if (trouble)
		return fail_query(error, json_is_text(text) ? text : NULL, trouble);
	if (!json_is_text(text) || !json_is_text(value))
		return fail_query(error, NULL, "the query is not UTF-8 text");
	if (query_get(query, text))
		return fail_query(error, text, "this query parameter is given twice; give it once");
	if (query->pair_count == QUERY_PAIRS_MAX)
		return fail_query(error, NULL, "the query has too many parameters");
	query->pairs[query->pair_count++] = (struct query_pair){text, value};
	return TW_OK;
}

enum tw_status query_parse(struct query *query, const char *target, struct tw_error *error)
{
	query->pair_count = 0;
	query->path = query->text;
	query->text[0] = 0;
	size_t length = strlen(target);
	if (length > QUERY_TEXT_MAX)
		return tw_fail(error, TW_ERROR_LIMIT, "uri-too-long", NULL,
			       "the request target is longer than %d bytes", QUERY_TEXT_MAX);
	memcpy(query->text, target, length + 1);
	char *rest = strchr(query->text, '?');
	if (rest)
		*rest++ = 0;
	while (rest) {
		char *text = strsep(&rest, "&");
		enum tw_status status = *text ? add_pair(query, text, error) : TW_OK;
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

const char *query_get(const struct query *query, const char *name)
{
	for (size_t i = 0; i < query->pair_count; i++)
		if (!strcmp(query->pairs[i].name, name))
			return query->pairs[i].value;
	return NULL;
}

enum tw_status query_name(const struct query *query, const char **name, struct tw_error *error)
{
	*name = query_get(query, "name");
	return *name ? names_check(*name, "invalid-parameter", "name", error) : TW_OK;
}

enum tw_status query_integer(const struct query *query, const char *name, int64_t fallback, int64_t minimum,
			     int64_t maximum, int64_t *value, struct tw_error *error)
{
	*value = fallback;
	const char *text = query_get(query, name);
	if (!text)
		return TW_OK;
	char *end = NULL;
	errno = 0;
	long long number = strtoll(text, &end, 10);
	if (end == text || *end || errno || isspace((unsigned char)*text) || number < minimum || number > maximum)
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", name,
			       "%s must be an integer from %lld to %lld", name, (long long)minimum, (long long)maximum);
	*value = number;
	return TW_OK;
}

enum tw_status query_only(const struct query *query, const char *const *known, struct tw_error *error)
{
	const struct names names = names_of(known);
	for (size_t i = 0; i < query->pair_count; i++) {
		const char *name = query->pairs[i].name;
		size_t k = 0;
		while (k < names.count && strcmp(names.list[k], name) != 0)
			k++;
		if (k == names.count)
			return names_refuse(&names, "query parameter", name, "unknown-parameter", name, error);
	}
	return TW_OK;
}

void query_encode(const char *text, char *out, size_t size)
{
	size_t used = 0;
	for (; *text && used + 4 <= size; text++) {
		if (isalnum((unsigned char)*text) || strchr("-._~", *text))
			out[used++] = *text;
		else
			used += (size_t)snprintf(out + used, size - used, "%%%02X", (unsigned char)*text);
	}
	if (size)
		out[used] = 0;
}
