/* Errors as application/problem+json (RFC 9457). */
#ifndef API_PROBLEM_H
#define API_PROBLEM_H

#include "api/response.h"

#define PROBLEM_URN "urn:tightwire:problem:"

/* The HTTP status of an error: by its type where that has one of its own, otherwise by its tw_status. */
unsigned problem_status(const struct tw_error *error);

/* {"type", "title", "status", "detail", "errors": [{"pointer" or "place", "detail"}]}; a `where` that is a JSON Pointer
 * becomes "pointer", any other ("line 12", "limit") "place". A new reference, NULL when out of memory. */
json_t *problem_json(const struct tw_error *error) TW_NODISCARD;

/* Answers with the problem, in place of whatever the response was. Headers that were set stay (Allow, for one). Never
 * fails: without memory the answer has no body. */
void problem_respond(struct api_response *response, const struct tw_error *error, const char *request_id);

#endif
