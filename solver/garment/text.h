/* Reading text without copying it: a line at a time, a word at a time, numbers correctly rounded. */
#ifndef SOLVER_GARMENT_TEXT_H
#define SOLVER_GARMENT_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A stretch of borrowed text. Advancing moves `at`; nothing beyond `end` is read. */
struct text {
	const char *at;
	const char *end;
};

/* Moves behind the byte order mark that some tools put before a text. */
void text_skip_mark(struct text *text);

/* The first word of the text behind a mark, empty lines and lines of comment; false where there is none. */
bool text_first_word(struct text text, struct text *word);

/* Whether it begins with the mark of UTF-16, which none of the readers takes. */
bool text_is_utf16(const struct text *text);

/* The next line, without its end, which is a line feed, a carriage return, or the two. False at the end of the text.
 * *lines grows by one. */
bool text_next_line(struct text *text, struct text *line, uint32_t *lines);

/* Where the line ends in a backslash and there is another: joins that one to it and returns true. */
bool text_join_line(struct text *text, struct text *line, uint32_t *lines);

/* The next word between blanks (space, tab, line ends, the backslash of a joined line); false when there is none before
 * the end or before a comment, which is a word that begins with #. */
bool text_next_word(struct text *line, struct text *word);

/* Whether the word is `keyword`, which is in lower case, in any case of its ASCII letters. */
bool text_equals(const struct text *word, const char *keyword);

/* The rest of the line without blanks at its two ends. */
struct text text_trimmed(struct text line);

/* The whole word as a finite number in C syntax without hexadecimal, correctly rounded. False for anything else: "nan",
 * "inf", "1e999", "12abc", "". */
bool text_to_number(const struct text *word, double *number);

/* A decimal integer with an optional sign at the start of the word; moves behind it. False where there is none or where
 * it does not fit. */
bool text_take_integer(struct text *word, int64_t *integer);

/* UTF-8 without control characters and without overlong or surrogate forms. */
bool text_is_utf8(const struct text *text);

/* Bytes of the valid UTF-8 text, at most `limit`, that do not cut a character: for "%.*s". */
int text_cut(const struct text *text, int limit);

/* Bytes of the valid UTF-8 `string`, at most `limit`, that do not cut a character: for "%.*s". */
int utf8_cut(const char *string, int limit);

#endif
