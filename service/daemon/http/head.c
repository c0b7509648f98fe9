/* First the end of the head is looked for, byte by byte and each only once, and everything that no head may hold is
 * refused on the way. Then the whole head is cut, line by line. */
#include "service/daemon/http/head.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define LEADING_MAX 4 /* bytes: two empty lines before a request are skipped (RFC 9112, 2.2) */

static enum head_outcome refuse(struct tw_error *error, const char *type, const char *where, const char *text)
{
	(void)tw_fail(error, TW_ERROR_INPUT, type, where, "%s", text);
	return HEAD_REFUSED;
}

static enum head_outcome refuse_line(struct tw_error *error, const char *type, size_t line, const char *text)
{
	char where[32];
	snprintf(where, sizeof where, "line %zu", line);
	return refuse(error, type, where, text);
}

static bool is_token_char(char c)
{
	unsigned char u = (unsigned char)c;
	return (u >= '0' && u <= '9') || (u >= 'a' && u <= 'z') || (u >= 'A' && u <= 'Z') ||
	       (u && strchr("!#$%&'*+-.^_`|~", u));
}

static size_t token_length(const char *text)
{
	size_t length = 0;
	while (is_token_char(text[length]))
		length++;
	return length;
}

static bool is_control(char c)
{
	return ((unsigned char)c < ' ' && c != '\t') || c == 127;
}

/* --- where it ends ------------------------------------------------------------------------------------------------ */

/* Of the byte at `end`; the request line is line 1. */
static size_t line_of(const struct head *head, const char *bytes, size_t end)
{
	size_t line = 1;
	for (size_t i = head->start; i < end; i++)
		line += bytes[i] == '\n';
	return line;
}

/* Goes on at head->scanned. Lines end with CR LF and with nothing else. */
static enum head_outcome find_end(struct head *head, const char *bytes, size_t size, struct tw_error *error)
{
	size_t end = size < HEAD_SIZE_MAX ? size : HEAD_SIZE_MAX;
	for (size_t i = head->scanned; i < end; i++) {
		char c = bytes[i];
		if ((i > 0 && bytes[i - 1] == '\r') != (c == '\n'))
			return refuse_line(error, "malformed-request", line_of(head, bytes, i),
					   "every line of a head ends with CR LF");
		if (is_control(c) && c != '\r' && c != '\n')
			return refuse_line(error, "malformed-request", line_of(head, bytes, i),
					   "the head holds a control character");
		head->scanned = i + 1;
		if (i == head->start && (c == '\r' || c == '\n')) {
			if (++head->start > LEADING_MAX)
				return refuse(error, "malformed-request", NULL, "a request begins with its method");
		} else if (c == '\n' && bytes[i - 2] == '\n') {
			head->size = i + 1;
			return HEAD_COMPLETE;
		}
	}
	if (size < HEAD_SIZE_MAX)
		return HEAD_INCOMPLETE;
	return memchr(bytes + head->start, '\n', end - head->start)
		       ? refuse(error, "head-too-large", NULL, "the head of the request is larger than 16384 bytes")
		       : refuse(error, "uri-too-long", NULL, "the request line is longer than 8000 bytes");
}

/* --- the request line -----------------------------------------------------------------------------------------------
 */

static bool is_host(const char *host)
{
	return strspn(host, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~%!$&'()*+,;=:[]") ==
	       strlen(host);
}

/* "http://host:port/path" names the host itself, in place of Host (RFC 9112, 3.2.2). The path is moved over what stands
 * before it, so that the host can be cut off. */
static enum head_outcome take_absolute(struct head *head, char *target, size_t scheme, struct tw_error *error)
{
	size_t length = strcspn(target + scheme, "/?#");
	char *path = target + scheme + length;
	memmove(target, target + scheme,
		length); /* the host, to the front: there is room for a 0 and a "/" behind it */
	target[length] = 0;
	head->host = target;
	if (*path != '/')
		*--path = '/';
	head->target = path;
	return length && is_host(target) ? HEAD_COMPLETE
					 : refuse(error, "malformed-request", NULL, "the target names no host");
}

static enum head_outcome take_target(struct head *head, char *target, struct tw_error *error)
{
	head->target = target;
	head->host = "";
	if (strlen(target) > HEAD_TARGET_MAX)
		return refuse(error, "uri-too-long", NULL, "the request line is longer than 8000 bytes");
	for (const char *p = target; *p; p++)
		if (is_control(*p) || *p == ' ' || *p == '\t' || *p == '#')
			return refuse(error, "malformed-request", NULL, "the target holds what no target may hold");
	if (target[0] == '/' || (!strcmp(target, "*") && !strcmp(head->method, "OPTIONS")))
		return HEAD_COMPLETE;
	if (!strncasecmp(target, "http://", 7))
		return take_absolute(head, target, 7, error);
	if (!strncasecmp(target, "https://", 8))
		return take_absolute(head, target, 8, error);
	return refuse(error, "malformed-request", NULL, "the target must begin with /");
}

static enum head_outcome take_version(struct head *head, const char *version, struct tw_error *error)
{
	head->is_old = !strcmp(version, "HTTP/1.0");
	if (head->is_old || !strcmp(version, "HTTP/1.1"))
		return HEAD_COMPLETE;
	bool is_version = !strncmp(version, "HTTP/", 5) && strlen(version) == 8 && version[5] >= '0' &&
			  version[5] <= '9' && version[6] == '.' && version[7] >= '0' && version[7] <= '9';
	return is_version ? refuse(error, "version-not-supported", NULL, "this service speaks HTTP/1.1")
			  : refuse(error, "malformed-request", NULL, "a request begins with METHOD TARGET HTTP/1.1");
}

static enum head_outcome take_request_line(struct head *head, char *line, struct tw_error *error)
{
	size_t length = token_length(line);
	char *target = line + length + 1;
	char *version = length && line[length] == ' ' ? strchr(target, ' ') : NULL;
	if (!version)
		return refuse(error, "malformed-request", NULL, "a request begins with METHOD TARGET HTTP/1.1");
	line[length] = 0;
	*version++ = 0;
	head->method = line;
	enum head_outcome outcome = take_version(head, version, error);
	return outcome == HEAD_COMPLETE ? take_target(head, target, error) : outcome;
}

/* --- fields ---------------------------------------------------------------------------------------------------------
 */

/* A line that is no field: said by the name where there is one, else by its number behind the request line. */
static enum head_outcome refuse_field(const struct head *head, char *line, size_t length, struct tw_error *error)
{
	static const char form[] = "a header reads NAME: VALUE, without a blank before the colon";
	bool has_blank = length && line[length + strspn(line + length, " \t")] == ':';
	line[length] = 0;
	return has_blank ? refuse(error, "malformed-header", line, form)
			 : refuse_line(error, "malformed-header", head->field_count + 2, form);
}

static enum head_outcome take_field(struct head *head, char *line, struct tw_error *error)
{
	size_t length = token_length(line);
	if (*line == ' ' || *line == '\t')
		return head->field_count ? refuse(error, "malformed-header", head->fields[head->field_count - 1].name,
						  "a header must stand on one line; this one goes on in the next")
					 : refuse_line(error, "malformed-header", 2, "a header must stand on one line");
	if (!length || line[length] != ':')
		return refuse_field(head, line, length, error);
	if (head->field_count == HEAD_FIELDS_MAX)
		return refuse(error, "head-too-large", NULL, "the request has more than 100 headers");
	line[length] = 0;
	char *value = line + length + 1;
	value += strspn(value, " \t");
	size_t end = strlen(value);
	while (end && (value[end - 1] == ' ' || value[end - 1] == '\t'))
		value[--end] = 0;
	head->fields[head->field_count++] = (struct head_field){line, value};
	return HEAD_COMPLETE;
}

/* What has one value: said twice, one reader takes the first and another the last. */
static bool is_single(const char *name)
{
	static const char *const single[] = {
		"Host",          "Content-Length",  "Transfer-Encoding", "Content-Type",
		"Authorization", "Idempotency-Key", "Upload-Offset",     "Upload-Complete",
		"Expect",        "Origin",          "X-Request-Id",      "Content-Encoding",
		"Job-Class",     "Job-Priority",    "Job-Group",         "Job-Max-Running",
		"Not-Before",    "Cancel-After",    "Supersedes",        "Session"};
	for (size_t i = 0; i < sizeof single / sizeof *single; i++)
		if (!strcasecmp(single[i], name))
			return true;
	return false;
}

static size_t append(char *text, size_t used, const char *glue, const char *value)
{
	char *end = stpcpy(stpcpy(text + used, glue), value);
	return (size_t)(end - text);
}

/* Joins the field with those of its name that follow; these lose their names. *used grows by what is written. */
static enum head_outcome join_field(struct head *head, size_t field, size_t *used, struct tw_error *error)
{
	struct head_field *first = &head->fields[field];
	char *text = head->joined + *used;
	bool is_joined = false;
	for (size_t i = field + 1; i < head->field_count; i++) {
		struct head_field *other = &head->fields[i];
		if (!other->name || strcasecmp(other->name, first->name) != 0)
			continue;
		if (is_single(first->name))
			return refuse(error, "malformed-header", first->name, "this header stands twice in the head");
		if (!is_joined)
			*used = append(head->joined, *used, "", first->value);
		*used = append(head->joined, *used, ", ", other->value);
		other->name = NULL;
		is_joined = true;
	}
	if (is_joined) {
		first->value = text;
		(*used)++;
	}
	return HEAD_COMPLETE;
}

/* A list may stand in several lines (RFC 9110, 5.3): "a" and "b" are "a, b". All joined texts together are shorter than
 * the head: a line costs a name, a colon, CR and LF beside its value. */
static enum head_outcome join_fields(struct head *head, struct tw_error *error)
{
	size_t kept = 0, used = 0;
	head->joined = malloc(head->size);
	if (!head->joined) {
		(void)tw_fail_memory(error);
		return HEAD_REFUSED;
	}
	for (size_t i = 0; i < head->field_count; i++) {
		if (!head->fields[i].name)
			continue;
		if (join_field(head, i, &used, error) != HEAD_COMPLETE)
			return HEAD_REFUSED;
		head->fields[kept++] = head->fields[i];
	}
	head->field_count = kept;
	return HEAD_COMPLETE;
}

/* --- what the fields say about the message ------------------------------------------------------------------------ */

static enum head_outcome check_host(struct head *head, struct tw_error *error)
{
	const char *host = head_find(head, "Host");
	if (!host && !head->is_old)
		return refuse(error, "malformed-header", "Host", "a request of HTTP/1.1 needs Host");
	if (host && !is_host(host))
		return refuse(error, "malformed-header", "Host", "this is no host");
	if (host && !head->host[0])
		head->host = host;
	return HEAD_COMPLETE;
}

static bool read_length(const char *text, uint64_t *length)
{
	*length = 0;
	for (const char *p = text; *p; p++) {
		unsigned digit = (unsigned)(*p - '0');
		if (digit > 9 || *length > (UINT64_MAX - digit) / 10)
			return false;
		*length = *length * 10 + digit;
	}
	return *text != 0;
}

/* Where the body ends (RFC 9112, 6.3), said in one way that everybody reads alike. */
static enum head_outcome check_framing(struct head *head, struct tw_error *error)
{
	const char *length = head_find(head, "Content-Length"), *encoding = head_find(head, "Transfer-Encoding");
	if (length && encoding)
		return refuse(error, "malformed-header", "Content-Length",
			      "say once where the body ends: Content-Length, or Transfer-Encoding: chunked");
	if (length && !read_length(length, &head->body_bytes))
		return refuse(error, "malformed-header", "Content-Length", "this is no number of bytes");
	if (encoding && (head->is_old || strcasecmp(encoding, "chunked") != 0))
		return refuse(error, "malformed-header", "Transfer-Encoding",
			      "the only transfer encoding here is chunked, alone, in HTTP/1.1");
	head->is_chunked = encoding != NULL;
	return HEAD_COMPLETE;
}

static bool list_has(const char *list, const char *word)
{
	size_t length = strlen(word);
	for (const char *p = list; p && *p; p += *p == ',') {
		p += strspn(p, " \t");
		size_t item = strcspn(p, ", \t");
		if (item == length && !strncasecmp(p, word, length))
			return true;
		p += strcspn(p, ",");
	}
	return false;
}

static enum head_outcome check_expectation(struct head *head, struct tw_error *error)
{
	const char *expect = head_find(head, "Expect");
	if (expect && strcasecmp(expect, "100-continue") != 0)
		return refuse(error, "expectation-failed", "Expect", "only 100-continue can be expected");
	head->expects = expect && !head->is_old;
	head->ends = head->is_old || list_has(head_find(head, "Connection"), "close");
	return HEAD_COMPLETE;
}

/* --- all of it ------------------------------------------------------------------------------------------------------
 */

/* The line at *rest without its end; *rest moves behind it. */
static char *cut_line(char **rest)
{
	char *line = *rest, *end = strchr(line, '\r');
	*end = 0;
	*rest = end + 2;
	return line;
}

enum head_outcome head_parse(struct head *head, char *bytes, size_t size, struct tw_error *error)
{
	enum head_outcome outcome = find_end(head, bytes, size, error);
	if (outcome != HEAD_COMPLETE)
		return outcome;
	bytes[head->size - 1] = 0; /* of the last CR LF: what follows is not ours */
	char *rest = bytes + head->start;
	outcome = take_request_line(head, cut_line(&rest), error);
	while (outcome == HEAD_COMPLETE && *rest != '\r')
		outcome = take_field(head, cut_line(&rest), error);
	if (outcome == HEAD_COMPLETE)
		outcome = join_fields(head, error);
	if (outcome == HEAD_COMPLETE)
		outcome = check_host(head, error);
	if (outcome == HEAD_COMPLETE)
		outcome = check_framing(head, error);
	return outcome == HEAD_COMPLETE ? check_expectation(head, error) : outcome;
}

const char *head_find(const struct head *head, const char *name)
{
	for (size_t i = 0; i < head->field_count; i++)
		if (!strcasecmp(head->fields[i].name, name))
			return head->fields[i].value;
	return NULL;
}

void head_clear(struct head *head)
{
	free(head->joined);
	*head = (struct head){0};
}
