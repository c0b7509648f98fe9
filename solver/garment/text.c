/* Numbers: up to 19 digits and a power of ten up to 22 are exact in a double's arithmetic (Clinger, How to read
 * floating point numbers accurately, 1990), which covers what mesh files hold; everything else goes to strtod. */
#include "solver/garment/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

static bool is_digit(char c)
{
	return c >= '0' && c <= '9';
}

/* Whether the line that ends before `end` goes on behind it. */
static bool is_continued(const char *start, const char *end)
{
	if (end > start && end[-1] == '\r')
		end--;
	return end > start && end[-1] == '\\';
}

static bool is_comment(const char *at, const char *end)
{
	while (at < end && is_blank(*at))
		at++;
	return at < end && *at == '#';
}

bool text_next_line(struct text *text, struct text *line, uint32_t *lines)
{
	if (text->at == text->end)
		return false;
	line->at = text->at;
	for (;;) {
		const char *newline = memchr(text->at, '\n', (size_t)(text->end - text->at));
		line->end = newline ? newline : text->end;
		bool continued = newline && is_continued(text->at, newline) && !is_comment(line->at, newline);
		text->at = newline ? newline + 1 : text->end;
		++*lines;
		if (!continued || text->at == text->end)
			return true;
	}
}

/* A backslash is a blank where a line end follows. */
static bool joins_lines(const char *at, const char *end)
{
	return *at == '\\' && ((at + 1 < end && at[1] == '\n') || (at + 2 < end && at[1] == '\r' && at[2] == '\n'));
}

bool text_next_word(struct text *line, struct text *word)
{
	const char *at = line->at;
	while (at < line->end && (is_blank(*at) || joins_lines(at, line->end)))
		at++;
	word->at = at;
	bool comment = at < line->end && *at == '#';
	while (!comment && at < line->end && !is_blank(*at) && !joins_lines(at, line->end))
		at++;
	word->end = at;
	line->at = at;
	return word->end > word->at;
}

bool text_equals(const struct text *word, const char *string)
{
	size_t size = strlen(string);
	return (size_t)(word->end - word->at) == size && memcmp(word->at, string, size) == 0;
}

struct text text_trimmed(struct text line)
{
	while (line.at < line.end && is_blank(*line.at))
		line.at++;
	while (line.at < line.end && is_blank(line.end[-1]))
		line.end--;
	return line;
}

static bool slow_number(const struct text *word, double *number)
{
	char copy[512];
	size_t size = (size_t)(word->end - word->at);
	if (size >= sizeof copy)
		return false;
	memcpy(copy, word->at, size);
	copy[size] = '\0';
	char *end = NULL;
	*number = strtod(copy, &end);
	return end == copy + size && isfinite(*number);
}

/* Decimal digits at *at, up to 19 of them that count; *exponent falls by one for each behind the point. */
static const char *take_digits(const char *at, const char *end, uint64_t *digits, int *count)
{
	for (; at < end && is_digit(*at); at++) {
		*digits = *digits * 10 + (uint64_t)(*at - '0');
		*count += *count > 0 || *digits > 0;
		if (*count > 19)
			break;
	}
	return at;
}

bool text_to_number(const struct text *word, double *number)
{
	static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
				       1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
	const char *at = word->at, *end = word->end;
	bool negative = at < end && *at == '-';
	at += at < end && (*at == '-' || *at == '+');
	const char *first = at;
	uint64_t digits = 0;
	int count = 0;
	at = take_digits(at, end, &digits, &count);
	ptrdiff_t taken = at - first, fraction = 0;
	if (at < end && *at == '.') {
		const char *behind = take_digits(at + 1, end, &digits, &count);
		fraction = behind - at - 1;
		taken += fraction;
		at = behind;
	}
	if (taken == 0)
		return false; /* "nan", "inf", "." */
	if (at < end && (*at == 'x' || *at == 'X'))
		return false;
	if (at < end || count > 19 || digits > (1ull << 53) || fraction > 22)
		return slow_number(word, number);
	*number = (double)digits / power[fraction];
	if (negative)
		*number = -*number;
	return true;
}

bool text_take_integer(struct text *word, int64_t *integer)
{
	const char *at = word->at;
	bool negative = at < word->end && *at == '-';
	at += at < word->end && (*at == '-' || *at == '+');
	const char *first = at;
	int64_t value = 0;
	for (; at < word->end && is_digit(*at); at++) {
		if (value > INT64_MAX / 10 - 10)
			return false;
		value = value * 10 + (*at - '0');
	}
	word->at = at;
	*integer = negative ? -value : value;
	return at > first;
}

/* Bytes of the character at `at`, 0 where it is none. */
static size_t utf8_length(const unsigned char *at, size_t size)
{
	if (at[0] < 0x80)
		return at[0] >= 0x20 && at[0] != 0x7f;
	size_t length = at[0] >= 0xc2 && at[0] < 0xe0   ? 2
			: (at[0] & 0xf0) == 0xe0        ? 3
			: at[0] >= 0xf0 && at[0] < 0xf5 ? 4
							: 0;
	if (length == 0 || length > size)
		return 0;
	for (size_t i = 1; i < length; i++) {
		if ((at[i] & 0xc0) != 0x80)
			return 0;
	}
	bool overlong = (at[0] == 0xe0 && at[1] < 0xa0) || (at[0] == 0xf0 && at[1] < 0x90);
	bool surrogate = at[0] == 0xed && at[1] >= 0xa0;
	bool beyond = at[0] == 0xf4 && at[1] >= 0x90;
	bool control = at[0] == 0xc2 && at[1] < 0xa0;
	return overlong || surrogate || beyond || control ? 0 : length;
}

bool text_is_utf8(const struct text *text)
{
	for (const char *at = text->at; at < text->end;) {
		size_t length = utf8_length((const unsigned char *)at, (size_t)(text->end - at));
		if (length == 0)
			return false;
		at += length;
	}
	return true;
}

int utf8_cut(const char *string, int limit)
{
	int size = (int)strnlen(string, (size_t)limit);
	while (size > 0 && ((unsigned char)string[size] & 0xc0) == 0x80)
		size--; /* the byte behind continues a character: leave that out */
	return size;
}
