/* Names that a user may choose from, and what to say when he has chosen another: the one that he probably meant, and
 * all that there are. One place for options, flags, fields, parts, query parameters and pattern pieces. */
#ifndef SOLVER_NAMES_H
#define SOLVER_NAMES_H

#include "tightwire.h"

struct names {
	const char *const *list; /* borrowed, as are the names; [count] */
	size_t count;
};

/* Of a list that ends with NULL; NULL itself is an empty one. */
struct names names_of(const char *const *list);

/* The name that `given` was probably meant to be: one or two letters wrong (a third of them in long names), another
 * case, - for _, or only a part of the name ("time_limit" for time_limit_s). NULL where none is near. */
const char *names_nearest(const struct names *names, const char *given);

/* TW_ERROR_INPUT: "no WHAT "GIVEN"; did you mean X? There are: A, B and C". A list that does not fit ends with how many
 * more there are. `type` and `where` as in struct tw_error. */
enum tw_status names_refuse(const struct names *names, const char *what, const char *given, const char *type,
			    const char *where, struct tw_error *error);

#define NAME_BYTES_MAX 200

/* What a user calls a thing stands in lists, logs and drawings: TW_ERROR_INPUT, with `type` and `where`, for a name of
 * more than NAME_BYTES_MAX bytes or with control characters. */
enum tw_status names_check(const char *name, const char *type, const char *where, struct tw_error *error) TW_NODISCARD;

#endif
