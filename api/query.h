/* The target of a request, cut into path and decoded query. Fixed in size: what does not fit is refused. */
#ifndef API_QUERY_H
#define API_QUERY_H

#include "tightwire.h"

#define QUERY_PAIRS_MAX 32
#define QUERY_TEXT_MAX 4096 /* bytes of path and query together */

struct query_pair {
	const char *name; /* both within the query's text, decoded */
	const char *value;
};

struct query {
	char text[QUERY_TEXT_MAX + 1];
	const char *path; /* within text, still percent-encoded: ids and names never need it */
	size_t pair_count;
	struct query_pair pairs[QUERY_PAIRS_MAX];
};

/* Cuts "/path?a=1&b=x%20y" (no fragment). TW_ERROR_INPUT: a broken percent escape, a zero byte, no UTF-8, a name twice,
 * too many pairs; TW_ERROR_LIMIT: too long. The pairs point into *query, which therefore must not be copied. */
enum tw_status query_parse(struct query *query, const char *target, struct tw_error *error) TW_NODISCARD;

/* The value of a parameter; NULL where it is not given. */
const char *query_get(const struct query *query, const char *name);

/* The parameter "name", what a user calls a thing (solver/names.h); NULL where it is not given. */
enum tw_status query_name(const struct query *query, const char **name, struct tw_error *error) TW_NODISCARD;

/* An integer parameter within [minimum, maximum], `fallback` where it is not given. */
enum tw_status query_integer(const struct query *query, const char *name, int64_t fallback, int64_t minimum,
			     int64_t maximum, int64_t *value, struct tw_error *error) TW_NODISCARD;

/* Fails on a parameter that is not among `known` (NULL-terminated, may be NULL for none). */
enum tw_status query_only(const struct query *query, const char *const *known, struct tw_error *error) TW_NODISCARD;

/* Writes `text` percent-encoded for use as a query value; cut at size - 1. */
void query_encode(const char *text, char *out, size_t size);

#endif
