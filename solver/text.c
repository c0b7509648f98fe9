#include "solver/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Room for `more` bytes and a NUL. */
static bool reserve(struct text *text, size_t more)
{
	if (text->failed)
		return false;
	size_t need;
	if (__builtin_add_overflow(text->size, more, &need) || need >= SIZE_MAX / 2) {
		text->failed = true;
		return false;
	}
	if (need < text->capacity)
		return true;
	size_t capacity = text->capacity ? 2 * text->capacity : 4096;
	while (capacity <= need)
		capacity *= 2;
	char *bytes = realloc(text->bytes, capacity);
	if (!bytes) {
		text->failed = true;
		return false;
	}
	text->bytes = bytes;
	text->capacity = capacity;
	return true;
}

static void add_bytes(struct text *text, const char *bytes, size_t size)
{
	if (!reserve(text, size))
		return;
	memcpy(text->bytes + text->size, bytes, size);
	text->size += size;
	text->bytes[text->size] = 0;
}

void text_add(struct text *text, const char *string)
{
	add_bytes(text, string, strlen(string));
}

void text_format(struct text *text, const char *format, ...)
{
	va_list arguments, again;
	va_start(arguments, format);
	va_copy(again, arguments);
	int length = vsnprintf(NULL, 0, format, arguments);
	va_end(arguments);
	if (length < 0)
		text->failed = true;
	else if (reserve(text, (size_t)length + 1)) {
		vsnprintf(text->bytes + text->size, (size_t)length + 1, format, again);
		text->size += (size_t)length;
	}
	va_end(again);
}

void text_integer(struct text *text, long value)
{
	char digits[24];
	size_t at = sizeof digits;
	unsigned long rest = value < 0 ? 0ul - (unsigned long)value : (unsigned long)value;
	do {
		digits[--at] = (char)('0' + rest % 10);
		rest /= 10;
	} while (rest);
	if (value < 0)
		digits[--at] = '-';
	add_bytes(text, digits + at, sizeof digits - at);
}

/* A locale may write anything between the digits of a number, several bytes even. */
static void use_decimal_point(char *digits)
{
	size_t whole = strspn(digits, "-0123456789"), mark = strcspn(digits + whole, "0123456789");
	if (!mark)
		return;
	digits[whole] = '.';
	memmove(digits + whole + 1, digits + whole + mark, strlen(digits + whole + mark) + 1);
}

/* The digits of a number that can be scaled to a whole one below 2^53; the count is 0 where that would round otherwise
 * than the C library, which knows all digits of a number half way between two. */
static size_t print_scaled(char *digits, double value, int decimals)
{
	static const double scales[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
	if (decimals < 0 || decimals > 9 || !(fabs(value) * scales[decimals] < 0x1p53))
		return 0;
	double scaled = fabs(value) * scales[decimals], half = fabs(scaled - floor(scaled) - 0.5);
	if (half <= scaled * 0x1p-51)
		return 0;
	unsigned long rest = (unsigned long)(scaled + 0.5);
	char reversed[24];
	size_t count = 0, length = 0, least = decimals ? (size_t)decimals + 2 : 1;
	while (rest || count < least) {
		reversed[count++] = (char)('0' + rest % 10);
		rest /= 10;
		if (count == (size_t)decimals)
			reversed[count++] = '.';
	}
	if (value < 0)
		digits[length++] = '-';
	while (count)
		digits[length++] = reversed[--count];
	return length;
}

void text_number(struct text *text, double value, int decimals)
{
	char digits[400];
	if (!isfinite(value)) {
		text_add(text, "null");
		return;
	}
	size_t length = print_scaled(digits, value, decimals);
	if (!length) {
		snprintf(digits, sizeof digits, "%.*f", decimals, value);
		use_decimal_point(digits);
		length = strlen(digits);
	}
	digits[length] = 0;
	if (strchr(digits, '.')) {
		while (length > 1 && digits[length - 1] == '0')
			length--;
		length -= digits[length - 1] == '.';
	}
	digits[length] = 0;
	text_add(text, !strcmp(digits, "-0") ? "0" : digits);
}

void text_json(struct text *text, const char *string)
{
	text_add(text, "\"");
	for (const char *c = string; *c; c++) {
		if (*c == '"' || *c == '\\')
			text_format(text, "\\%c", *c);
		else if ((unsigned char)*c < 0x20)
			text_format(text, "\\u%04x", (unsigned)(unsigned char)*c);
		else
			add_bytes(text, c, 1);
	}
	text_add(text, "\"");
}

void text_xml(struct text *text, const char *string)
{
	for (const char *c = string; *c; c++) {
		/* U+FFFE and U+FFFF are no XML characters, in UTF-8 EF BF BE and EF BF BF. */
		if (!strncmp(c, "\xef\xbf\xbe", 3) || !strncmp(c, "\xef\xbf\xbf", 3)) {
			add_bytes(text, "\xef\xbf\xbd", 3);
			c += 2;
		} else if (*c == '<') {
			text_add(text, "&lt;");
		} else if (*c == '>') {
			text_add(text, "&gt;");
		} else if (*c == '&') {
			text_add(text, "&amp;");
		} else if (*c == '"') {
			text_add(text, "&quot;");
		} else if (*c == '\'') {
			text_add(text, "&#39;");
		} else {
			add_bytes(text, (unsigned char)*c < 0x20 ? " " : c, 1);
		}
	}
}

enum tw_status text_take(struct text *text, struct arena *arena, const char **bytes, size_t *size,
			 struct tw_error *error)
{
	char *copy = text->failed ? NULL : arena_array(arena, text->size + 1, 1);
	if (copy) {
		memcpy(copy, text->size ? text->bytes : "", text->size);
		copy[text->size] = 0;
		*bytes = copy;
		*size = text->size;
	}
	text_clear(text);
	return copy ? TW_OK : tw_fail_memory(error);
}

void text_clear(struct text *text)
{
	free(text->bytes);
	*text = (struct text){0};
}
