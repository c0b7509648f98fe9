#include "api/route.h"

#include <stdio.h>
#include <string.h>

/* Whether `path` fits the template; what braces matched goes into match->parameters. */
static bool fits(const char *template, const char *path, struct route_match *match)
{
	size_t parameter = 0;
	while (*template) {
		if (*template != '{') {
			if (*template ++ != *path++)
				return false;
			continue;
		}
		size_t length = strcspn(path, "/");
		if (!length || length >= ROUTE_PARAMETER_SIZE || parameter == ROUTE_PARAMETERS_MAX)
			return false;
		memcpy(match->parameters[parameter], path, length);
		match->parameters[parameter++][length] = 0;
		path += length;
		template = strchr(template, '}') + 1;
	}
	return !*path;
}

static void allow(struct route_match *match, const char *method)
{
	size_t used = strlen(match->allow);
	snprintf(match->allow + used, sizeof match->allow - used, "%s%s%s", used ? ", " : "", method,
		 strcmp(method, "GET") == 0 ? ", HEAD" : "");
}

/* Literal paths stand before templates that would match them too, so the first fit is the path that is meant. */
void route_find(const char *method, const char *path, struct route_match *match)
{
	*match = (struct route_match){0};
	const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
	const char *template = NULL;
	for (const struct route *r = api_routes; r->method; r++) {
		struct route_match trial = {0};
		if (template ? strcmp(template, r->path) != 0 : !fits(r->path, path, &trial))
			continue;
		if (!template)
			memcpy(match->parameters, trial.parameters, sizeof match->parameters);
		template = r->path;
		match->path_known = true;
		allow(match, r->method);
		if (!strcmp(r->method, wanted))
			match->route = r;
	}
	if (match->path_known)
		allow(match, "OPTIONS");
}
