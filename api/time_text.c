#include "api/time_text.h"

#include "api/header.h"

#include <string.h>
#include <time.h>

bool time_text_read_span(const char *text, int64_t *span_ms)
{
	static const struct {
		const char *name;
		int64_t ms;
	} units[] = {{"", 1000}, {"ms", 1}, {"s", 1000}, {"m", 60000}, {"h", 3600000}, {"d", 86400000}};
	size_t digits = strspn(text, "0123456789");
	uint64_t count = 0;
	if (!header_number(text, digits, &count))
		return false;
	for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
		if (strcmp(text + digits, units[i].name) != 0)
			continue;
		*span_ms = 0;
		if (count < 1 || count > (uint64_t)(TIME_TEXT_SPAN_MAX_MS / units[i].ms))
			return false;
		*span_ms = (int64_t)count * units[i].ms;
		return true;
	}
	return false;
}

/* `count` digits as a number in [minimum, maximum], and `behind` them; moves on. */
static bool take_digits(const char **p, size_t count, int minimum, int maximum, char behind, int *value)
{
	*value = 0;
	for (size_t i = 0; i < count; i++, (*p)++) {
		if (**p < '0' || **p > '9')
			return false;
		*value = 10 * *value + (**p - '0');
	}
	if (behind && *(*p)++ != behind)
		return false;
	return *value >= minimum && *value <= maximum;
}

/* "Z", or "+02:00" as minutes to subtract. */
static bool take_zone(const char **p, int *minutes)
{
	int hour = 0, minute = 0;
	char sign = *(*p)++;
	*minutes = 0;
	if (sign == 'Z' || sign == 'z')
		return true;
	if (sign != '+' && sign != '-')
		return false;
	if (!take_digits(p, 2, 0, 23, ':', &hour) || !take_digits(p, 2, 0, 59, 0, &minute))
		return false;
	*minutes = (sign == '-' ? -1 : 1) * (60 * hour + minute);
	return true;
}

bool time_text_read(const char *text, int64_t *time_ms)
{
	struct tm tm = {0};
	int minutes = 0, second = 0, ms = 0, scale = 100;
	const char *p = text;
	if (!take_digits(&p, 4, 1970, 9999, '-', &tm.tm_year) || !take_digits(&p, 2, 1, 12, '-', &tm.tm_mon) ||
	    !take_digits(&p, 2, 1, 31, 0, &tm.tm_mday))
		return false;
	if (*p != 'T' && *p != 't' && *p != ' ')
		return false;
	p++;
	if (!take_digits(&p, 2, 0, 23, ':', &tm.tm_hour) || !take_digits(&p, 2, 0, 59, ':', &tm.tm_min) ||
	    !take_digits(&p, 2, 0, 60, 0, &second)) /* a leap second is the next minute */
		return false;
	if (*p == '.') {
		const char *first = ++p;
		for (; *p >= '0' && *p <= '9'; p++, scale /= 10)
			ms += scale * (*p - '0');
		if (p == first)
			return false;
	}
	if (!take_zone(&p, &minutes) || *p)
		return false;
	int day = tm.tm_mday;
	tm.tm_year -= 1900;
	tm.tm_mon -= 1;
	int64_t seconds = timegm(&tm) + second - 60 * (int64_t)minutes;
	*time_ms = seconds < 0 ? 0 : 1000 * seconds + ms;
	return tm.tm_mday == day; /* 30 February would have become 1 or 2 March */
}
