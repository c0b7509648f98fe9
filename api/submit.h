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
 * A word has 1 to SUBMIT_WORD_MAX visible ASCII characters; a time span is a whole number with one of the units ms, s,
 * m, h, d, seconds without. */
#ifndef API_SUBMIT_H
#define API_SUBMIT_H

#include "storage/job_request.h"
#include "tightwire.h"

enum { SUBMIT_WORD_MAX = 64, SUBMIT_PRIORITY_MAX = 1000, SUBMIT_RUNNING_MAX = 100000 };
#define SUBMIT_SPAN_MAX_MS (366ll * 24 * 3600 * 1000)
/* What submit_read_span wants, for messages. */
#define SUBMIT_SPAN_FORM "a time span as 90s, 500ms, 5m, 8h or 2d, or 90 for seconds; more than 0, at most 366d"

struct submit {
	struct job_request queue; /* without affinity; texts borrowed from the headers */
	uint32_t wait_s;          /* of Prefer; 0: it does not wait */
};

/* `header` gives the value of a header, NULL where there is none; `now_ms` is the time by the machine's clock.
 * TW_ERROR_INPUT "malformed-header" with the header's name. */
enum tw_status submit_parse(struct submit *submit, const char *(*header)(void *context, const char *name),
			    void *context, int64_t now_ms, struct tw_error *error) TW_NODISCARD;

/* A time span as above, 1 ms to SUBMIT_SPAN_MAX_MS. */
bool submit_read_span(const char *text, int64_t *span_ms);

#endif
