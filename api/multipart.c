/* A state machine over the bytes. In a part's data the only interesting byte is '\r', the first of the delimiter
 * "\r\n--boundary": memchr finds it, everything before goes out as it is. As '\r' occurs nowhere else in the delimiter,
 * a match that breaks off can only start anew at the byte that broke it; what had matched was data, and is known. */
#include "api/multipart.h"

#include "api/header.h"

#include <string.h>
#include <strings.h>

static enum tw_status fail_multipart(struct tw_error *error, const char *text)
{
	return tw_fail(error, TW_ERROR_INPUT, "malformed-multipart", NULL, "%s", text);
}

enum tw_status multipart_init(struct multipart *multipart, const char *content_type, struct multipart_sink sink,
			      struct tw_error *error)
{
	char boundary[MULTIPART_BOUNDARY_MAX + 1];
	*multipart = (struct multipart){.sink = sink};
	if (!header_parameter(content_type, "boundary", boundary, sizeof boundary) || !boundary[0] ||
	    strpbrk(boundary, "\r\n"))
		return tw_fail(error, TW_ERROR_INPUT, "malformed-header", "Content-Type",
			       "multipart/form-data needs a boundary of 1 to %d characters", MULTIPART_BOUNDARY_MAX);
	multipart->delimiter_size =
		(size_t)snprintf(multipart->delimiter, sizeof multipart->delimiter, "\r\n--%s", boundary);
	/* The first boundary may be the first thing in the body, without a line end before it. */
	multipart->matched = 2;
	return TW_OK;
}

static enum tw_status emit(struct multipart *m, const char *bytes, size_t size, struct tw_error *error)
{
	if (!size || m->state == MULTIPART_PREAMBLE)
		return TW_OK;
	return m->sink.data(m->sink.context, bytes, size, error);
}

/* Reads data up to and with the next delimiter. *used: bytes consumed. */
static enum tw_status take_data(struct multipart *m, const char *bytes, size_t size, size_t *used,
				struct tw_error *error)
{
	size_t i = 0, start = 0;
	while (i < size) {
		if (!m->matched) {
			const char *found = memchr(bytes + i, '\r', size - i);
			i = found ? (size_t)(found - bytes) : size;
			enum tw_status status = emit(m, bytes + start, i - start, error);
			if (status != TW_OK)
				return status;
			if (!found)
				break;
		}
		if (bytes[i] == m->delimiter[m->matched]) {
			i++;
			if (++m->matched < m->delimiter_size)
				continue;
			*used = i;
			enum tw_status status =
				m->state == MULTIPART_DATA ? m->sink.end(m->sink.context, error) : TW_OK;
			m->state = MULTIPART_DELIMITER;
			m->matched = 0;
			return status;
		}
		enum tw_status status = emit(m, m->delimiter, m->matched, error);
		if (status != TW_OK)
			return status;
		m->matched = 0;
		start = i;
	}
	*used = size;
	return TW_OK;
}

/* The two bytes behind a boundary decide what follows; blanks before the line end are allowed (RFC 2046). */
static enum tw_status take_after_delimiter(struct multipart *m, char byte, struct tw_error *error)
{
	if (!m->matched && (byte == ' ' || byte == '\t'))
		return TW_OK;
	m->after[m->matched++] = byte;
	if (m->matched < 2)
		return TW_OK;
	m->matched = 0;
	m->header_size = 0;
	if (!memcmp(m->after, "\r\n", 2))
		m->state = MULTIPART_HEADERS;
	else if (!memcmp(m->after, "--", 2))
		m->state = MULTIPART_EPILOGUE;
	else
		return fail_multipart(error, "a boundary is followed by something other than a line end or \"--\"");
	return TW_OK;
}

static void read_header_line(struct multipart *m, char *line)
{
	char *colon = strchr(line, ':');
	if (!colon)
		return;
	*colon = 0;
	const char *value = colon + 1 + strspn(colon + 1, " \t");
	if (!strcasecmp(line, "Content-Disposition") && !strncasecmp(value, "form-data", 9)) {
		header_parameter(value, "name", m->part.name, sizeof m->part.name);
		header_parameter(value, "filename", m->part.file_name, sizeof m->part.file_name);
	} else if (!strcasecmp(line, "Content-Type")) {
		header_media_type(value, m->part.media_type, sizeof m->part.media_type);
	}
}

/* Collects a part's headers up to the empty line, then begins the part. */
static enum tw_status take_header(struct multipart *m, char byte, struct tw_error *error)
{
	if (m->header_size == MULTIPART_HEADER_MAX)
		return fail_multipart(error, "the headers of a part are too long");
	if (!byte)
		return fail_multipart(error, "the headers of a part hold a zero byte");
	m->header[m->header_size++] = byte;
	m->header[m->header_size] = 0;
	bool empty = !strcmp(m->header, "\r\n");
	if (!empty && (m->header_size < 4 || strcmp(m->header + m->header_size - 4, "\r\n\r\n") != 0))
		return TW_OK;
	m->part = (struct multipart_part){0};
	for (char *rest = m->header, *line; (line = strsep(&rest, "\n"));) {
		line[strcspn(line, "\r")] = 0;
		read_header_line(m, line);
	}
	if (!m->part.name[0])
		return fail_multipart(error,
				      "a part has no usable name; give Content-Disposition: form-data; name=\"…\"");
	m->state = MULTIPART_DATA;
	m->matched = 0;
	return m->sink.begin(m->sink.context, &m->part, error);
}

enum tw_status multipart_feed(struct multipart *multipart, const void *bytes, size_t size, struct tw_error *error)
{
	const char *p = bytes;
	for (size_t i = 0; i < size;) {
		enum tw_status status = TW_OK;
		size_t used = 1;
		switch (multipart->state) {
		case MULTIPART_PREAMBLE:
		case MULTIPART_DATA:
			status = take_data(multipart, p + i, size - i, &used, error);
			break;
		case MULTIPART_DELIMITER:
			status = take_after_delimiter(multipart, p[i], error);
			break;
		case MULTIPART_HEADERS:
			status = take_header(multipart, p[i], error);
			break;
		case MULTIPART_EPILOGUE:
			return TW_OK;
		}
		if (status != TW_OK)
			return status;
		i += used;
	}
	return TW_OK;
}

enum tw_status multipart_finish(const struct multipart *multipart, struct tw_error *error)
{
	if (multipart->state == MULTIPART_EPILOGUE)
		return TW_OK;
	return fail_multipart(error, "the body ends before its last boundary");
}
