/* A job as JSON. */
#ifndef API_JOB_VIEW_H
#define API_JOB_VIEW_H

#include "storage/attempt.h"
#include "storage/job.h"

#include <jansson.h>

/* The job with all that clients may know of it. A new reference, NULL when out of memory. */
json_t *job_show(const struct job *job) TW_NODISCARD;

/* The reason of a failed job as a problem; null for any other. */
json_t *job_show_problem(const struct job *job) TW_NODISCARD;

/* A list of states, "queued,running", as the bits of a query; 0 for NULL. TW_ERROR_INPUT "invalid-parameter". */
enum tw_status job_states_parse(const char *text, unsigned *states, struct tw_error *error) TW_NODISCARD;

/* An attempt that came to nothing. */
json_t *job_show_attempt(const struct attempt *attempt) TW_NODISCARD;

#endif
