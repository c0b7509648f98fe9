#include "service/daemon/http/relay.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#define ANSWER_HEAD_MAX (32u << 10) /* of the engine's answer; what it writes is far smaller */

/* --- pending bytes --------------------------------------------------------------------------------------------------
 */

bool relay_has_pending(const struct pending *pending)
{
	return pending->start < pending->end;
}

static bool add(struct pending *pending, const char *bytes, size_t size)
{
	if (pending->start == pending->end)
		pending->start = pending->end = 0;
	if (pending->capacity - pending->end < size) {
		size_t capacity = 2 * (pending->end + size);
		char *grown = realloc(pending->bytes, capacity);
		if (!grown)
			return false;
		pending->bytes = grown;
		pending->capacity = capacity;
	}
	memcpy(pending->bytes + pending->end, bytes, size);
	pending->end += size;
	return true;
}

static bool add_text(struct pending *pending, const char *text)
{
	return add(pending, text, strlen(text));
}

static void clear(struct pending *pending)
{
	free(pending->bytes);
	*pending = (struct pending){0};
}

static enum relay_outcome send_pending(struct pending *pending, int socket, uint64_t *moved)
{
	while (relay_has_pending(pending)) {
		ssize_t count = send(socket, pending->bytes + pending->start, pending->end - pending->start,
				     MSG_NOSIGNAL | MSG_DONTWAIT);
		if (count < 0 && (errno == EAGAIN || errno == EINTR))
			return RELAY_BLOCKED;
		if (count < 0)
			return RELAY_SHUT;
		pending->start += (size_t)count;
		*moved += (uint64_t)count;
	}
	return RELAY_CLEAR;
}

/* --- to the engine --------------------------------------------------------------------------------------------------
 */

/* What is said of this connection, or in another place. */
static bool is_ours(const char *name)
{
	static const char *const ours[] = {"Connection", "Keep-Alive",        "Host",    "Content-Length",
					   "TE",         "Transfer-Encoding", "Upgrade", "Proxy-Connection"};
	for (size_t i = 0; i < sizeof ours / sizeof *ours; i++)
		if (!strcasecmp(ours[i], name))
			return true;
	return false;
}

static bool add_field(struct pending *up, const char *name, const char *value)
{
	return add_text(up, name) && add_text(up, ": ") && add_text(up, value) && add_text(up, "\r\n");
}

static bool add_head(struct pending *up, const struct head *head)
{
	char length[24];
	bool fits = add_text(up, head->method) && add_text(up, " ") && add_text(up, head->target) &&
		    add_text(up, head->is_old ? " HTTP/1.0\r\n" : " HTTP/1.1\r\n") && add_field(up, "Host", head->host);
	for (size_t i = 0; i < head->field_count && fits; i++)
		fits = is_ours(head->fields[i].name) || add_field(up, head->fields[i].name, head->fields[i].value);
	snprintf(length, sizeof length, "%llu", (unsigned long long)head->body_bytes);
	if (head->is_chunked)
		fits = fits && add_field(up, "Transfer-Encoding", "chunked");
	else if (head->body_bytes)
		fits = fits && add_field(up, "Content-Length", length);
	return fits && add_text(up, "Connection: close\r\n\r\n");
}

bool relay_open(struct relay *relay, struct engine *engine, const struct head *head, const char *peer)
{
	struct engine_link *link = NULL;
	int socket = engine_connect(engine, peer, &link);
	*relay = (struct relay){.socket = socket, .watcher = -1, .link = link};
	relay->is_head = !strcmp(head->method, "HEAD");
	return relay->socket >= 0 && add_head(&relay->up, head);
}

void relay_unwatch(struct relay *relay)
{
	if (relay->watcher >= 0)
		epoll_ctl(relay->watcher, EPOLL_CTL_DEL, relay->socket, NULL);
	relay->watcher = -1;
}

void relay_close(struct relay *relay)
{
	if (relay->socket >= 0) {
		relay_unwatch(relay);
		close(relay->socket);
		engine_unlink(relay->link);
	}
	clear(&relay->up);
	clear(&relay->down);
	clear(&relay->head);
	*relay = RELAY_NONE;
}

bool relay_put(struct relay *relay, const struct head *head, const char *data, size_t size)
{
	char frame[24];
	if (!size)
		return true;
	if (!head->is_chunked)
		return add(&relay->up, data, size);
	snprintf(frame, sizeof frame, "%zx\r\n", size);
	return add_text(&relay->up, frame) && add(&relay->up, data, size) && add_text(&relay->up, "\r\n");
}

bool relay_put_end(struct relay *relay, const struct head *head)
{
	return !head->is_chunked || add_text(&relay->up, "0\r\n\r\n");
}

enum relay_outcome relay_push(struct relay *relay)
{
	uint64_t moved = 0;
	enum relay_outcome outcome = relay->is_shut ? RELAY_SHUT : send_pending(&relay->up, relay->socket, &moved);
	if (outcome == RELAY_SHUT) {
		relay->is_shut = true;
		relay->up.start = relay->up.end = 0;
	}
	return outcome;
}

/* --- to the client --------------------------------------------------------------------------------------------------
 */

static bool begins(const char *line, const char *name)
{
	size_t length = strlen(name);
	return !strncasecmp(line, name, length) && line[length] == ':';
}

static const char *value_of(const char *line)
{
	const char *value = strchr(line, ':') + 1;
	return value + strspn(value, " ");
}

/* The head of the answer, a string of whole lines, without what was said about the pair's connection. */
static bool pass_head(struct relay *relay, char *head, bool ends)
{
	unsigned long status = strtoul(head + sizeof "HTTP/1.1", NULL, 10);
	bool fits = true;
	for (char *line = head, *end; fits && *line && *line != '\r'; line = end) {
		end = strchr(line, '\n') + 1;
		if (line != head && (begins(line, "Connection") || begins(line, "Keep-Alive")))
			continue;
		if (begins(line, "Content-Length")) {
			relay->has_length = true;
			relay->left = strtoull(value_of(line), NULL, 10);
		}
		if (begins(line, "Transfer-Encoding"))
			relay->is_chunked = true;
		fits = add(&relay->down, line, (size_t)(end - line));
	}
	if (status < 200) { /* 100 Continue: the answer is yet to come */
		relay->has_length = relay->is_chunked = false;
		return fits && add_text(&relay->down, "\r\n");
	}
	relay->has_begun = true;
	bool has_body = !relay->is_head && status != 204 && status != 304;
	relay->is_complete = !has_body || (relay->has_length && !relay->left);
	return fits && add_text(&relay->down, ends ? "Connection: close\r\n\r\n" : "\r\n");
}

static bool pass_body(struct relay *relay, const char *bytes, size_t size)
{
	if (relay->is_complete || !size)
		return true;
	if (relay->has_length) {
		size = size < relay->left ? size : (size_t)relay->left;
		relay->left -= size;
		relay->is_complete = !relay->left;
	}
	for (size_t at = 0; relay->is_chunked && at < size && relay->chunk.state != CHUNK_END;) {
		const char *data = NULL;
		size_t data_size = 0;
		at += chunk_take(&relay->chunk, bytes + at, size - at, &data, &data_size);
		if (relay->chunk.state == CHUNK_BROKEN)
			return false;
		relay->is_complete = relay->chunk.state == CHUNK_END;
	}
	return add(&relay->down, bytes, size);
}

/* Passes heads as long as there are whole ones, then what is of the body. */
static bool take_answer(struct relay *relay, const char *bytes, size_t size, bool ends)
{
	if (relay->has_begun)
		return pass_body(relay, bytes, size);
	if (!add(&relay->head, bytes, size) || relay->head.end > ANSWER_HEAD_MAX + size)
		return false;
	while (!relay->has_begun) {
		char *start = relay->head.bytes + relay->head.start;
		char *end = memmem(start, relay->head.end - relay->head.start, "\r\n\r\n", 4);
		if (!end)
			return relay->head.end - relay->head.start <= ANSWER_HEAD_MAX;
		end[2] = 0; /* a string of whole lines */
		if (!pass_head(relay, start, ends))
			return false;
		relay->head.start = (size_t)(end + 4 - relay->head.bytes);
	}
	return pass_body(relay, relay->head.bytes + relay->head.start, relay->head.end - relay->head.start);
}

enum relay_outcome relay_pull(struct relay *relay, char *scratch, size_t size, bool ends)
{
	ssize_t got = recv(relay->socket, scratch, size, MSG_DONTWAIT);
	if (got < 0 && (errno == EAGAIN || errno == EINTR))
		return RELAY_BLOCKED;
	if (got > 0)
		return take_answer(relay, scratch, (size_t)got, ends) ? RELAY_CLEAR : RELAY_SHUT;
	if (relay->has_begun && !relay->has_length && !relay->is_chunked)
		relay->is_complete = true; /* of HTTP/1.0: its end is the connection's */
	return RELAY_SHUT;
}

enum relay_outcome relay_deliver(struct relay *relay, int client, uint64_t *moved)
{
	return send_pending(&relay->down, client, moved);
}
