#include "api/header.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

static bool is_token(char c)
{
	return c && (isalnum((unsigned char)c) || strchr("!#$%&'*+-.^_`|~", c));
}

static const char *skip_space(const char *p)
{
	while (*p == ' ' || *p == '\t')
		p++;
	return p;
}

bool header_media_type(const char *content_type, char *media_type, size_t size)
{
	media_type[0] = 0;
	if (!content_type)
		return false;
	const char *p = skip_space(content_type);
	size_t length = 0, slashes = 0;
	for (; is_token(p[length]) || p[length] == '/'; length++)
		slashes += p[length] == '/';
	const char *end = skip_space(p + length);
	if (slashes != 1 || p[0] == '/' || p[length - 1] == '/' || length >= size || (*end && *end != ';'))
		return false;
	for (size_t i = 0; i < length; i++)
		media_type[i] = (char)tolower((unsigned char)p[i]);
	media_type[length] = 0;
	return true;
}

/* Reads a token or a quoted string at p into `out` (cut off at its size, *fits then false). Returns where it ends, or
 * NULL when a quoted string has no end. */
static const char *read_value(const char *p, char *out, size_t size, bool *fits)
{
	size_t length = 0;
	bool quoted = *p == '"';
	*fits = true;
	for (p += quoted; quoted ? *p != '"' : is_token(*p); p++) {
		if (quoted && *p == '\\')
			p++;
		if (!*p)
			return NULL;
		if (length + 1 < size)
			out[length++] = *p;
		else
			*fits = false;
	}
	out[length] = 0;
	return p + quoted;
}

bool header_parameter(const char *value, const char *name, char *parameter, size_t size)
{
	parameter[0] = 0;
	const char *p = value ? strchr(value, ';') : NULL;
	size_t name_length = strlen(name);
	while (p && *p == ';') {
		p = skip_space(p + 1);
		const char *start = p;
		while (is_token(*p))
			p++;
		bool wanted = (size_t)(p - start) == name_length && !strncasecmp(start, name, name_length);
		if (*p != '=')
			return false;
		bool fits = false;
		p = read_value(p + 1, parameter, size, &fits);
		if (!p)
			break;
		if (wanted)
			return fits;
		p = skip_space(p);
	}
	parameter[0] = 0;
	return false;
}

/* Whether a media range of `length` characters covers the media type, and how closely: 0 not, 1 as anything,
 * 2 by its type, 3 exactly. */
static int range_fit(const char *range, size_t length, const char *media_type)
{
	if (length == 3 && !memcmp(range, "*/*", 3))
		return 1;
	const char *slash = strchr(media_type, '/');
	size_t type_length = (size_t)(slash - media_type) + 1;
	if (length == type_length + 1 && range[length - 1] == '*' && !strncasecmp(range, media_type, type_length))
		return 2;
	return length == strlen(media_type) && !strncasecmp(range, media_type, length) ? 3 : 0;
}

/* "q=0", "q=0.", "q=0.000": not at all. */
static bool is_zero_quality(const char *parameters)
{
	char q[8];
	if (!header_parameter(parameters, "q", q, sizeof q))
		return false;
	return q[0] == '0' && strspn(q + 1, ".0") == strlen(q + 1);
}

bool header_accepts(const char *accept, const char *media_type)
{
	if (!accept || !*skip_space(accept))
		return true;
	int best = 0;
	bool welcome = false;
	for (const char *p = accept; *p;) {
		p = skip_space(p);
		size_t length = strcspn(p, " \t;,"), item = strcspn(p, ",");
		int fit = range_fit(p, length, media_type);
		if (fit > best) {
			char parameters[128] = "";
			if (item - length < sizeof parameters)
				memcpy(parameters, p + length, item - length);
			best = fit;
			welcome = !is_zero_quality(parameters);
		}
		p += item;
		p += *p == ',';
	}
	return welcome;
}

bool header_number(const char *p, size_t length, uint64_t *number)
{
	*number = 0;
	for (size_t i = 0; i < length; i++) {
		unsigned digit = (unsigned)(p[i] - '0');
		if (digit > 9 || *number > (UINT64_MAX - digit) / 10)
			return false;
		*number = *number * 10 + digit;
	}
	return length > 0;
}

uint32_t header_prefer_wait_s(const char *prefer)
{
	for (const char *p = prefer; p && *p;) {
		p = skip_space(p);
		size_t item = strcspn(p, ",;");
		if (!strncasecmp(p, "wait=", 5)) {
			size_t digits = strspn(p + 5, "0123456789");
			uint64_t seconds = 0;
			bool fits = header_number(p + 5, digits, &seconds) && seconds <= UINT32_MAX;
			return fits || !digits ? (uint32_t)seconds : UINT32_MAX;
		}
		p += item;
		p += *p != 0;
	}
	return 0;
}

bool header_prefers(const char *prefer, const char *name, const char *value)
{
	size_t name_length = strlen(name), value_length = value ? strlen(value) + 1 : 0;
	for (const char *p = prefer; p && *p;) {
		p = skip_space(p);
		size_t item = strcspn(p, ",; \t");
		if (item == name_length + value_length && !strncasecmp(p, name, name_length) &&
		    (!value || (p[name_length] == '=' && !strncmp(p + name_length + 1, value, value_length - 1))))
			return true;
		p += strcspn(p, ",;");
		p += *p != 0;
	}
	return false;
}

bool header_matches_etag(const char *if_none_match, const char *etag)
{
	size_t length = strlen(etag);
	for (const char *p = if_none_match; p && *p;) {
		p = skip_space(p);
		if (*p == '*')
			return true;
		if (!strncmp(p, "W/", 2))
			p += 2;
		if (!strncmp(p, etag, length) && (!*skip_space(p + length) || *skip_space(p + length) == ','))
			return true;
		p += strcspn(p, ",");
		p += *p == ',';
	}
	return false;
}

bool header_content_length(const char *content_length, uint64_t *bytes)
{
	*bytes = UINT64_MAX;
	if (!content_length)
		return false;
	const char *p = skip_space(content_length);
	uint64_t number = 0;
	if (header_number(p, strcspn(p, " \t"), &number))
		*bytes = number;
	return true;
}
