#include "api/origin.h"

#include <ctype.h>
#include <stddef.h>
#include <string.h>
#include <strings.h>

/* The host without its port: "[::1]:80" is "[::1]". */
static size_t host_length(const char *host)
{
	const char *end = *host == '[' ? strchr(host, ']') : NULL;
	return end ? (size_t)(end - host) + 1 : strcspn(host, ":");
}

static bool is_port(const char *text)
{
	return !*text || (*text == ':' && strspn(text + 1, "0123456789") == strlen(text + 1));
}

/* Four numbers with dots, the first 127; nothing else, or "127.0.0.1.evil.example" would be one. */
static bool is_loopback_number(const char *host, size_t length)
{
	unsigned dots = 0;
	for (size_t i = 0; i < length; i++) {
		if (!isdigit((unsigned char)host[i]) && host[i] != '.')
			return false;
		dots += host[i] == '.';
	}
	return dots == 3 && length > 4 && !strncmp(host, "127.", 4);
}

static bool is_among(const char *names, const char *host, size_t length)
{
	for (const char *p = names; *p; p += *p == ',') {
		p += strspn(p, " \t");
		size_t item = strcspn(p, ", \t");
		if (item == length && item && !strncasecmp(p, host, length))
			return true;
		p += strcspn(p, ",");
	}
	return false;
}

bool origin_is_local_host(const char *host, const char *names)
{
	size_t length = host_length(host);
	if (!is_port(host + length))
		return false;
	return (length == 9 && !strncasecmp(host, "localhost", 9)) || (length == 5 && !strncmp(host, "[::1]", 5)) ||
	       is_loopback_number(host, length) || is_among(names, host, length);
}

bool origin_is_welcome(const char *origin, const char *host, const char *cors_origin)
{
	if (!origin || !strcmp(cors_origin, "*") || (*cors_origin && !strcasecmp(origin, cors_origin)))
		return true;
	const char *place = strstr(origin, "://");
	return place && !strcasecmp(place + 3, host);
}
