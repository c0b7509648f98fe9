#include "service/command/amount.h"

#include <string.h>
#include <time.h>

#define DIGITS_MAX 15 /* so that no unit overflows */

/* The digits at the beginning; false where there are none, or too many. */
static bool take_number(const char **text, int64_t *number)
{
	size_t digits = strspn(*text, "0123456789");
	*number = 0;
	for (size_t i = 0; i < digits && digits <= DIGITS_MAX; i++)
		*number = 10 * *number + ((*text)[i] - '0');
	*text += digits;
	return digits && digits <= DIGITS_MAX;
}

static bool multiply(int64_t *number, int64_t unit)
{
	return !__builtin_mul_overflow(*number, unit, number);
}

enum tw_status amount_parse_count(const char *flag, const char *text, bool binary, int64_t *count,
				  struct tw_error *error)
{
	static const char units[] = "kMGT";
	const char *rest = text;
	bool is_number = take_number(&rest, count);
	const char *unit = *rest ? strchr(units, *rest) : NULL;
	if (is_number && !*count)
		return tw_fail(error, TW_ERROR_INPUT, "usage", flag,
			       "is a whole number from 1 on; for what is usual, leave the flag out");
	if (is_number && binary && unit && !rest[1] && multiply(count, INT64_C(1) << 10 * (unit - units + 1)))
		return TW_OK;
	if (is_number && !*rest)
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "usage", flag, "\"%.40s\" is no number%s", text,
		       binary ? ", as in 500M or 10G" : "");
}

enum tw_status amount_parse_duration(const char *flag, const char *text, int64_t *duration_ms, struct tw_error *error)
{
	static const struct {
		char letter;
		int64_t ms;
	} units[] = {{'s', 1000}, {'m', 60000}, {'h', 3600000}, {'d', 86400000}};
	const char *rest = text;
	bool is_number = take_number(&rest, duration_ms);
	for (size_t i = 0; is_number && i < sizeof units / sizeof *units; i++)
		if (rest[0] == units[i].letter && !rest[1] && multiply(duration_ms, units[i].ms))
			return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "usage", flag, "\"%.40s\" is no time, as in 30s, 15m, 12h or 90d", text);
}

static bool parse_day(const char *text, int64_t *time_ms)
{
	struct tm day = {0};
	const char *end = strptime(text, "%Y-%m-%d", &day);
	struct tm again = day;
	time_t seconds = end && !*end ? timegm(&again) : -1;
	/* What is no day, the 31st of June, has become another. */
	if (seconds < 0 || again.tm_mday != day.tm_mday)
		return false;
	*time_ms = 1000 * (int64_t)seconds;
	return true;
}

enum tw_status amount_parse_time(const char *flag, const char *text, int64_t now_ms, int64_t *time_ms,
				 struct tw_error *error)
{
	if (parse_day(text, time_ms))
		return TW_OK;
	if (amount_parse_duration(flag, text, time_ms, error) == TW_OK &&
	    !__builtin_add_overflow(*time_ms, now_ms, time_ms))
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "usage", flag,
		       "\"%.40s\" is no day as in 2027-01-31, and no time as in 90d", text);
}
