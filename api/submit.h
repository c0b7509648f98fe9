/* How a request that starts a job wants it queued: headers, the same for every such request. None of them says what is
 * computed, so none is part of a content address or of what an Idempotency-Key stands for.
 *
 *     Job-Class: interactive | normal | batch    else interactive with Prefer: wait, normal without
 *     Job-Priority: -1000 … 1000                 within the class and the client; higher first
 *     Job-Group: WORD                            with Job-Max-Running: N, so many of the group run at a time
 *     Not-Before: 2026-11-28T22:00:00Z | 8h      not started before then, or for so long
 *     Cancel-After: 90s                          queued or running, it ends then
 *     Supersedes: WORD                           cancels what the client asked for with the same word before
 *     Session: WORD                              what is dragged: goes to the worker that did the last of it
 *     Prefer: wait=N, on_disconnect=cancel       hold the connection; and a client that leaves wants it no more
 *
 * A word has 1 to SUBMIT_WORD_MAX visible ASCII characters; times and time spans are those of api/time_text.h. */
#ifndef API_SUBMIT_H
#define API_SUBMIT_H

#include "storage/job_request.h"
#include "tightwire.h"

enum { SUBMIT_WORD_MAX = 64, SUBMIT_PRIORITY_MAX = 1000, SUBMIT_RUNNING_MAX = 100000 };

struct submit {
	struct job_request queue; /* without affinity; texts borrowed from the headers */
	uint32_t wait_s;          /* of Prefer; 0: it does not wait */
};

/* `header` gives the value of a header, NULL where there is none; `now_ms` is the time by the machine's clock.
 * TW_ERROR_INPUT "malformed-header" with the header's name. */
enum tw_status submit_parse(struct submit *submit, const char *(*header)(void *context, const char *name),
			    void *context, int64_t now_ms, struct tw_error *error) TW_NODISCARD;

#endif
