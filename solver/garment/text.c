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

void text_skip_mark(struct text *text)
{
	if (text->end - text->at >= 3 && memcmp(text->at, "\xef\xbb\xbf", 3) == 0)
		text->at += 3;
}

bool text_is_utf16(const struct text *text)
{
	return text->end - text->at >= 2 &&
	       (memcmp(text->at, "\xff\xfe", 2) == 0 || memcmp(text->at, "\xfe\xff", 2) == 0);
}

/* The first line feed or carriage return, or the end. In short stretches, so that a file that has but one of the two is
 * not searched to its end for the other at every line. */
static const char *line_end(const char *at, const char *end)
{
	enum { STRETCH = 256 };
	while (at < end) {
		size_t size = end - at < STRETCH ? (size_t)(end - at) : STRETCH;
		const char *feed = memchr(at, '\n', size);
		const char *carriage = memchr(at, '\r', feed ? (size_t)(feed - at) : size);
		if (feed || carriage)
			return carriage ? carriage : feed;
		at += size;
	}
	return end;
}

bool text_next_line(struct text *text, struct text *line, uint32_t *lines)
{
	if (text->at == text->end)
		return false;
	line->at = text->at;
	line->end = text->at = line_end(text->at, text->end);
	text->at += text->at < text->end && *text->at == '\r';
	text->at += text->at < text->end && *text->at == '\n' && (text->at == line->end || text->at[-1] == '\r');
	++*lines;
	return true;
}

bool text_join_line(struct text *text, struct text *line, uint32_t *lines)
{
	struct text next;
	if (line->end == line->at || line->end[-1] != '\\' || !text_next_line(text, &next, lines))
		return false;
	line->end = next.end;
	return true;
}

/* A backslash is a blank where a line end follows. */
static bool joins_lines(const char *at, const char *end)
{
	return *at == '\\' && at + 1 < end && (at[1] == '\n' || at[1] == '\r');
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

bool text_first_word(struct text text, struct text *word)
{
	struct text line;
	uint32_t lines = 0;
	text_skip_mark(&text);
	while (text_next_line(&text, &line, &lines)) {
		if (text_next_word(&line, word))
			return true;
	}
	return false;
}

bool text_equals(const struct text *word, const char *keyword)
{
	size_t size = (size_t)(word->end - word->at), i = 0;
	for (; i < size && keyword[i]; i++) {
		char c = word->at[i];
		if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != keyword[i])
			return false;
	}
	return i == size && !keyword[i];
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

int text_cut(const struct text *text, int limit)
{
	if (text->end - text->at <= limit)
		return (int)(text->end - text->at);
	while (limit > 0 && ((unsigned char)text->at[limit] & 0xc0) == 0x80)
		limit--;
	return limit;
}

int utf8_cut(const char *string, int limit)
{
	int size = (int)strnlen(string, (size_t)limit);
	while (size > 0 && ((unsigned char)string[size] & 0xc0) == 0x80)
		size--; /* the byte behind continues a character: leave that out */
	return size;
}
