/* Amounts as people write them on a command line: 90d, 10G, 2027-01-31. */
#ifndef SERVICE_COMMAND_AMOUNT_H
#define SERVICE_COMMAND_AMOUNT_H

#include "tightwire.h"

#include <stdbool.h>

/* A whole number from 1 on, with k, M, G or T (of 1024) behind it where `binary`. `flag` is named in the error. */
enum tw_status amount_parse_count(const char *flag, const char *text, bool binary, int64_t *count,
				  struct tw_error *error) TW_NODISCARD;

/* "30s", "15m", "12h", "90d". */
enum tw_status amount_parse_duration(const char *flag, const char *text, int64_t *duration_ms,
				     struct tw_error *error) TW_NODISCARD;

/* A duration from `now_ms`, or the beginning of a day in UTC, "2027-01-31"; since 1970. */
enum tw_status amount_parse_time(const char *flag, const char *text, int64_t now_ms, int64_t *time_ms,
				 struct tw_error *error) TW_NODISCARD;

#endif
