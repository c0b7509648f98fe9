#include "service/host_port.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PORT_MAX = 65535 };

bool host_port_parse(struct host_port *parts, const char *text)
{
	const char *colon = strrchr(text, ':');
	size_t length = colon ? (size_t)(colon - text) : 0, digits = colon ? strlen(colon + 1) : 0;
	if (!digits || digits >= sizeof parts->port || strspn(colon + 1, "0123456789") != digits)
		return false;
	parts->number = (unsigned)strtoul(colon + 1, NULL, 10);
	bool bracketed = length >= 2 && text[0] == '[' && colon[-1] == ']';
	length -= bracketed ? 2 : 0;
	if (length >= sizeof parts->host || parts->number > PORT_MAX)
		return false;
	memcpy(parts->host, text + bracketed, length);
	parts->host[length] = 0;
	snprintf(parts->port, sizeof parts->port, "%u", parts->number);
	return true;
}
