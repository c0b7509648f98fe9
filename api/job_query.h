/* Which jobs a request means: the query parameters that listing, cancelling and redriving have in common. */
#ifndef API_JOB_QUERY_H
#define API_JOB_QUERY_H

#include "api/call.h"
#include "storage/jobs.h"

/* ?kind= ?state= ?class= ?group= ?problem= ?older_than=, and what `more` (NULL-terminated, may be NULL) names besides.
 * Texts are borrowed from the call. TW_ERROR_INPUT "invalid-parameter", "unknown-parameter". */
enum tw_status job_query_parse(const struct api_call *call, const char *const *more, struct job_query *query,
			       struct tw_error *error) TW_NODISCARD;

#endif
