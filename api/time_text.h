/* Times and time spans as people and clients write them. Those that we write ourselves are json_time's. */
#ifndef API_TIME_TEXT_H
#define API_TIME_TEXT_H

#include <stdbool.h>
#include <stdint.h>

#define TIME_TEXT_SPAN_MAX_MS (366ll * 24 * 3600 * 1000)
/* What time_text_read_span wants, for messages. */
#define TIME_TEXT_SPAN_FORM "a time span as 90s, 500ms, 5m, 8h or 2d, or 90 for seconds; more than 0, at most 366d"

/* A whole number with one of the units ms, s, m, h, d; seconds without. 1 ms to TIME_TEXT_SPAN_MAX_MS. */
bool time_text_read_span(const char *text, int64_t *span_ms);

/* RFC 3339: "2026-11-28T22:00:00Z", "2026-11-28T22:00:00.250+01:00". Milliseconds since 1970, 0 before. */
bool time_text_read(const char *text, int64_t *time_ms);

#endif
