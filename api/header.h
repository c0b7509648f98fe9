/* The request headers that the api understands, parsed. All take the value as it came and accept NULL as "not sent". */
#ifndef API_HEADER_H
#define API_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Content-Type: the media type without parameters, in lower case. False, and an empty text, when it does not fit or is
 * not of the form type/subtype. */
bool header_media_type(const char *content_type, char *media_type, size_t size);

/* A parameter of a header like Content-Type or Content-Disposition, a quoted one unquoted (RFC 9110, 5.6.6). False when
 * it is absent, malformed or longer than size - 1. */
bool header_parameter(const char *value, const char *name, char *parameter, size_t size);

/* Accept: whether a representation of this media type is welcome (RFC 9110, 12.5.1; ranges and q=0 count, orders of
 * preference do not, since every resource has one representation). */
bool header_accepts(const char *accept, const char *media_type);

/* Prefer: seconds of its "wait" (RFC 7240); 0 when it has none, UINT32_MAX when they are more. */
uint32_t header_prefer_wait_s(const char *prefer);

/* Prefer: whether it says NAME=VALUE, or where `value` is NULL the name alone; that in any case. */
bool header_prefers(const char *prefer, const char *name, const char *value);

/* `length` decimal digits, at least one, without sign or blanks; false also when the number does not fit. */
bool header_number(const char *p, size_t length, uint64_t *number);

/* If-None-Match: whether it names this entity tag, which is given with its quotes (weak comparison). */
bool header_matches_etag(const char *if_none_match, const char *etag);

/* Content-Length: false when absent; a number that is none or overflows counts as UINT64_MAX. */
bool header_content_length(const char *content_length, uint64_t *bytes);

#endif
