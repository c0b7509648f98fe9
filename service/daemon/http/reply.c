#include "service/daemon/http/reply.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>

#define BLOCK_BYTES (256u << 10) /* read from a stream at once */
#define FRAME_BYTES 12           /* "fffffff\r\n" before the data of a chunk */
#define BLOCKS_AT_ONCE 8         /* then others have their turn, however fast this client reads */
#define BLOCK_SIZE (FRAME_BYTES + BLOCK_BYTES + 2)

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

static void print_length(const struct reply *reply, FILE *out)
{
	const struct api_response *response = reply->response;
	if (reply->is_chunked)
		fputs("Transfer-Encoding: chunked\r\n", out);
	else if (response->status == 204 || response->status == 304)
		return;
	else if (!response->stream)
		fprintf(out, "Content-Length: %zu\r\n", response->size);
	else if (response->stream->size != API_STREAM_UNKNOWN)
		fprintf(out, "Content-Length: %llu\r\n", (unsigned long long)response->stream->size);
}

bool reply_begin(struct reply *reply, struct api_response *response, const struct reply_terms *terms)
{
	const struct api_stream *stream = response->stream;
	bool has_length = !stream || stream->size != API_STREAM_UNKNOWN;
	*reply = (struct reply){.response = response};
	reply->has_body = !terms->is_head && response->status != 204 && response->status != 304;
	reply->is_chunked = reply->has_body && !has_length && !terms->is_old;
	reply->is_over = !reply->has_body || !stream;
	if (reply->has_body && stream && !(reply->block = malloc(BLOCK_SIZE)))
		return false;
	FILE *out = open_memstream(&reply->head, &reply->head_size);
	if (!out)
		return false;
	fprintf(out, "HTTP/1.1 %u %s\r\n", response->status, reason_of(response->status));
	print_date(out);
	for (size_t i = 0; i < response->header_count; i++)
		fprintf(out, "%s: %s\r\n", response->headers[i].name, response->headers[i].value);
	print_length(reply, out);
	fputs(terms->ends ? "Connection: close\r\n\r\n" : "\r\n", out);
	bool failed = ferror(out);
	return fclose(out) == 0 && !failed;
}

/* The next piece of the stream into the block, as a chunk where the reply is chunked; the last chunk behind the last
 * piece. */
static enum reply_outcome refill(struct reply *reply, bool truncate)
{
	struct api_stream *stream = reply->response->stream;
	char *data = reply->block + FRAME_BYTES;
	size_t got = 0;
	if (stream->read(stream, reply->offset, data, BLOCK_BYTES, &got) != TW_OK)
		return REPLY_BROKEN;
	if (!got && stream->is_waiting && !truncate)
		return REPLY_WAITING;
	reply->offset += got;
	reply->is_over = !got || reply->offset == stream->size;
	if (!got && !reply->is_chunked)
		return stream->size == API_STREAM_UNKNOWN || reply->offset == stream->size ? REPLY_DONE : REPLY_BROKEN;
	reply->block_start = FRAME_BYTES;
	reply->block_end = FRAME_BYTES + got;
	if (!reply->is_chunked)
		return REPLY_DONE;
	char frame[FRAME_BYTES + 1];
	size_t frame_size = (size_t)snprintf(frame, sizeof frame, "%zx\r\n", got);
	reply->block_start = FRAME_BYTES - frame_size;
	memcpy(reply->block + reply->block_start, frame, frame_size);
	memcpy(reply->block + reply->block_end, "\r\n", 2);
	reply->block_end += 2;
	return REPLY_DONE;
}

/* What the socket takes of the head, and of what is in memory of the body. */
static enum reply_outcome write_some(struct reply *reply, int socket, uint64_t *sent)
{
	struct iovec pieces[2] = {{reply->head, reply->head_size}, {NULL, 0}};
	if (reply->block)
		pieces[1] = (struct iovec){reply->block + reply->block_start, reply->block_end - reply->block_start};
	else if (reply->has_body)
		pieces[1] = (struct iovec){reply->response->bytes, reply->response->size};
	size_t total = pieces[0].iov_len + pieces[1].iov_len;
	while (reply->sent < total) {
		struct iovec left[2] = {pieces[0], pieces[1]};
		size_t skip = reply->sent < left[0].iov_len ? reply->sent : left[0].iov_len;
		size_t skip_more = reply->sent - skip;
		left[0] = (struct iovec){(char *)left[0].iov_base + skip, left[0].iov_len - skip};
		left[1] = (struct iovec){(char *)left[1].iov_base + skip_more, left[1].iov_len - skip_more};
		struct msghdr message = {.msg_iov = left, .msg_iovlen = 2};
		ssize_t count = sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
		if (count < 0)
			return errno == EAGAIN || errno == EINTR ? REPLY_BLOCKED : REPLY_BROKEN;
		reply->sent += (size_t)count;
		*sent += (uint64_t)count;
	}
	reply->sent = 0;
	reply->head_size = 0;
	reply->block_start = reply->block_end = 0;
	return REPLY_DONE;
}

enum reply_outcome reply_send(struct reply *reply, int socket, bool truncate, uint64_t *sent)
{
	for (unsigned i = 0; i < BLOCKS_AT_ONCE; i++) {
		enum reply_outcome outcome = write_some(reply, socket, sent);
		if (outcome != REPLY_DONE || reply->is_over)
			return outcome;
		outcome = refill(reply, truncate);
		if (outcome != REPLY_DONE)
			return outcome;
	}
	return REPLY_BLOCKED;
}

void reply_clear(struct reply *reply)
{
	free(reply->head);
	free(reply->block);
	*reply = (struct reply){0};
}
