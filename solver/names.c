/* Nearness is the optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours. */
#include "solver/names.h"

#include <ctype.h>
#include <limits.h>
#include <stdbool.h>
#include <string.h>

enum { LENGTH_MAX = 63 }; /* of what is compared; longer texts are not near to anything */

/* Case, and - or _, make no difference. */
static char fold(char c)
{
	return c == '-' ? '_' : (char)tolower((unsigned char)c);
}

static unsigned least(unsigned a, unsigned b)
{
	return a < b ? a : b;
}

static unsigned distance(const char *a, size_t a_length, const char *b, size_t b_length)
{
	unsigned row[3][LENGTH_MAX + 1]; /* of a[i], of a[i - 1], of a[i - 2] */
	unsigned *here = row[0], *above = row[1], *before = row[2];
	for (size_t j = 0; j <= b_length; j++)
		here[j] = (unsigned)j;
	for (size_t i = 1; i <= a_length; i++) {
		unsigned *next = before;
		before = above;
		above = here;
		here = next;
		here[0] = (unsigned)i;
		for (size_t j = 1; j <= b_length; j++) {
			char p = fold(a[i - 1]), q = fold(b[j - 1]);
			here[j] = least(least(above[j], here[j - 1]) + 1, above[j - 1] + (p != q));
			if (i > 1 && j > 1 && p == fold(b[j - 2]) && q == fold(a[i - 2]))
				here[j] = least(here[j], before[j - 2] + 1);
		}
	}
	return here[b_length];
}

static bool contains(const char *name, const char *given, size_t length)
{
	for (; strlen(name) >= length; name++) {
		size_t i = 0;
		while (i < length && fold(name[i]) == fold(given[i]))
			i++;
		if (i == length)
			return true;
	}
	return false;
}

struct names names_of(const char *const *list)
{
	size_t count = 0;
	while (list && list[count])
		count++;
	return (struct names){list, count};
}

const char *names_nearest(const struct names *names, const char *given)
{
	size_t length = strlen(given);
	const char *nearest = NULL;
	unsigned nearest_off = UINT_MAX;
	for (size_t i = 0; i < names->count && length <= LENGTH_MAX; i++) {
		const char *name = names->list[i];
		size_t name_length = strlen(name);
		if (name_length > LENGTH_MAX)
			continue;
		unsigned off = distance(given, length, name, name_length);
		unsigned allowed = length < 3 ? 0 : length < 7 ? 2 : (unsigned)length / 3;
		if (length >= 3 && contains(name, given, length))
			off = least(off, allowed);
		if (off <= allowed && off < nearest_off) {
			nearest = name;
			nearest_off = off;
		}
	}
	return nearest;
}

/* "a, b and c", cut at a whole name: "a, b and 17 more". */
static void list_names(const struct names *names, char *text, size_t size)
{
	size_t used = 0;
	text[0] = 0;
	for (size_t i = 0; i < names->count; i++) {
		const char *glue = i == 0 ? "" : i + 1 == names->count ? " and " : ", ";
		size_t needed = strlen(glue) + strlen(names->list[i]);
		size_t reserve = i + 1 == names->count ? 1 : sizeof " and 9999 more";
		if (used + needed + reserve > size) {
			snprintf(text + used, size - used, "%s%zu more", i ? " and " : "", names->count - i);
			return;
		}
		used += (size_t)snprintf(text + used, size - used, "%s%s", glue, names->list[i]);
	}
}

enum tw_status names_refuse(const struct names *names, const char *what, const char *given, const char *type,
			    const char *where, struct tw_error *error)
{
	char start[168], list[208]; /* together less than an error holds */
	const char *nearest = names_nearest(names, given);
	if (nearest)
		snprintf(start, sizeof start, "no %.30s \"%.40s\"; did you mean %.63s?", what, given, nearest);
	else
		snprintf(start, sizeof start, "no %.30s \"%.40s\";", what, given);
	list_names(names, list, sizeof list);
	if (!names->count)
		return tw_fail(error, TW_ERROR_INPUT, type, where, "%s there is none here; leave it out", start);
	return tw_fail(error, TW_ERROR_INPUT, type, where, "%s %s: %s", start, nearest ? "There are" : "there are",
		       list);
}

enum tw_status names_check(const char *name, const char *type, const char *where, struct tw_error *error)
{
	if (strlen(name) > NAME_BYTES_MAX)
		return tw_fail(error, TW_ERROR_INPUT, type, where, "must have at most %d bytes", NAME_BYTES_MAX);
	for (const char *p = name; *p; p++)
		if ((unsigned char)*p < 0x20 || *p == 0x7f)
			return tw_fail(error, TW_ERROR_INPUT, type, where, "must not have control characters");
	return TW_OK;
}
