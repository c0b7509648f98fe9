#include "service/daemon/http/reply.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>

static const char *reason_of(unsigned status)
{
	static const struct {
		unsigned status;
		const char *reason;
	} reasons[] = {
		{200, "OK"},
		{201, "Created"},
		{202, "Accepted"},
		{204, "No Content"},
		{304, "Not Modified"},
		{400, "Bad Request"},
		{401, "Unauthorized"},
		{403, "Forbidden"},
		{404, "Not Found"},
		{405, "Method Not Allowed"},
		{406, "Not Acceptable"},
		{408, "Request Timeout"},
		{409, "Conflict"},
		{413, "Content Too Large"},
		{414, "URI Too Long"},
		{415, "Unsupported Media Type"},
		{417, "Expectation Failed"},
		{421, "Misdirected Request"},
		{422, "Unprocessable Content"},
		{429, "Too Many Requests"},
		{431, "Request Header Fields Too Large"},
		{500, "Internal Server Error"},
		{501, "Not Implemented"},
		{503, "Service Unavailable"},
		{505, "HTTP Version Not Supported"},
		{507, "Insufficient Storage"},
	};
	for (size_t i = 0; i < sizeof reasons / sizeof *reasons; i++)
		if (reasons[i].status == status)
			return reasons[i].reason;
	return "";
}

/* RFC 9110, 5.6.7: English whatever the locale. */
static void print_date(FILE *out)
{
	static const char days[][4] = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
	static const char months[][4] = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
					 "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
	time_t now = time(NULL);
	struct tm parts;
	gmtime_r(&now, &parts);
	fprintf(out, "Date: %s, %02d %s %d %02d:%02d:%02d GMT\r\n", days[parts.tm_wday], parts.tm_mday,
		months[parts.tm_mon], 1900 + parts.tm_year, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

bool reply_begin(struct reply *reply, const struct api_response *response, bool is_head, bool ends)
{
	assert(!response->stream);
	bool may_have_body = response->status != 204 && response->status != 304;
	*reply = (struct reply){.response = response, .has_body = may_have_body && !is_head};
	FILE *out = open_memstream(&reply->head, &reply->head_size);
	if (!out)
		return false;
	fprintf(out, "HTTP/1.1 %u %s\r\n", response->status, reason_of(response->status));
	print_date(out);
	for (size_t i = 0; i < response->header_count; i++)
		fprintf(out, "%s: %s\r\n", response->headers[i].name, response->headers[i].value);
	if (may_have_body)
		fprintf(out, "Content-Length: %zu\r\n", response->size);
	fputs(ends ? "Connection: close\r\n\r\n" : "\r\n", out);
	bool failed = ferror(out);
	return fclose(out) == 0 && !failed;
}

enum reply_outcome reply_send(struct reply *reply, int socket, uint64_t *sent)
{
	size_t size = reply->has_body ? reply->response->size : 0;
	while (reply->sent < reply->head_size + size) {
		size_t of_head = reply->sent < reply->head_size ? reply->sent : reply->head_size;
		size_t of_body = reply->sent - of_head;
		struct iovec left[2] = {{reply->head + of_head, reply->head_size - of_head}, {NULL, size - of_body}};
		if (left[1].iov_len)
			left[1].iov_base = reply->response->bytes + of_body;
		struct msghdr message = {.msg_iov = left, .msg_iovlen = 2};
		ssize_t count = sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
		if (count < 0)
			return errno == EAGAIN || errno == EINTR ? REPLY_BLOCKED : REPLY_BROKEN;
		reply->sent += (size_t)count;
		*sent += (uint64_t)count;
	}
	return REPLY_DONE;
}

void reply_clear(struct reply *reply)
{
	free(reply->head);
	*reply = (struct reply){0};
}
