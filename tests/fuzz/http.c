/* Bytes as a client sends them, in two cuts: head and body read at once, and in pieces whose sizes the input chooses,
 * give the same. The first byte chooses the cut. What is let in is as strict as it claims to be. */
#include "service/daemon/http/chunk.h"
#include "service/daemon/http/head.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What came of one reading. */
struct reading {
	enum head_outcome outcome;
	const char *type; /* of the refusal */
	uint64_t hash;    /* of all that was read */
	enum chunk_state state;
};

static uint64_t mix(uint64_t hash, const void *bytes, size_t size)
{
	for (size_t i = 0; i < size; i++)
		hash = (hash ^ ((const uint8_t *)bytes)[i]) * 1099511628211u;
	return hash;
}

static uint64_t mix_text(uint64_t hash, const char *text)
{
	return mix(hash, text, strlen(text) + 1);
}

/* Every text of the head is one line of printable bytes, and what decides about the body is there once. */
static void check_head(const struct head *head)
{
	unsigned framings = 0;
	for (size_t i = 0; i < head->field_count; i++) {
		if (strpbrk(head->fields[i].name, " \t\r\n:") || strpbrk(head->fields[i].value, "\r\n"))
			abort();
		framings += !strcasecmp(head->fields[i].name, "Content-Length") ||
			    !strcasecmp(head->fields[i].name, "Transfer-Encoding");
	}
	if (framings > 1 || (head->is_chunked && head->body_bytes) || strpbrk(head->target, " \t\r\n"))
		abort();
	if (head->target[0] != '/' && strcmp(head->target, "*") != 0)
		abort();
}

static void read_body(struct reading *reading, const char *bytes, size_t size, size_t step)
{
	struct chunk chunk = {0};
	size_t at = 0, limit = 0;
	while (at < size && chunk.state != CHUNK_END && chunk.state != CHUNK_BROKEN) {
		const char *piece = NULL;
		size_t piece_size = 0;
		if (limit <= at)
			limit = size - at < step ? size : at + step;
		size_t used = chunk_take(&chunk, bytes + at, limit - at, &piece, &piece_size);
		if (used > limit - at || (piece_size && (piece < bytes + at || piece + piece_size > bytes + limit)))
			abort();
		reading->hash = mix(reading->hash, piece, piece_size);
		at += used;
	}
	reading->state = chunk.state;
	reading->hash = mix(reading->hash, &at, sizeof at);
}

static struct reading read_all(const uint8_t *data, size_t size, size_t step)
{
	struct reading reading = {.outcome = HEAD_INCOMPLETE, .hash = 14695981039346656037u};
	struct head head = {0};
	struct tw_error error = {0};
	char *bytes = NULL;
	size_t came = 0;
	while (reading.outcome == HEAD_INCOMPLETE && came < size) {
		size_t next = size - came < step ? size : came + step;
		char *moved = malloc(next); /* as a buffer that grows: the bytes move */
		if (!moved)
			exit(0);
		if (came)
			memcpy(moved, bytes, came);
		memcpy(moved + came, data + came, next - came);
		free(bytes);
		bytes = moved;
		came = next;
		reading.outcome = head_parse(&head, bytes, came, &error);
	}
	reading.type = error.type;
	if (reading.outcome == HEAD_COMPLETE) {
		check_head(&head);
		reading.hash = mix_text(mix_text(mix_text(reading.hash, head.method), head.target), head.host);
		for (size_t i = 0; i < head.field_count; i++)
			reading.hash = mix_text(mix_text(reading.hash, head.fields[i].name), head.fields[i].value);
		reading.hash = mix(reading.hash, &head.body_bytes, sizeof head.body_bytes);
		read_body(&reading, (const char *)data + head.size, size - head.size, step);
	}
	head_clear(&head);
	free(bytes);
	return reading;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	if (!size)
		return 0;
	size_t step = 1 + data[0] % 16;
	struct reading whole = read_all(data + 1, size - 1, SIZE_MAX), cut = read_all(data + 1, size - 1, step);
	if (whole.outcome != cut.outcome || whole.hash != cut.hash || whole.state != cut.state)
		abort();
	if (whole.outcome == HEAD_REFUSED && (!whole.type || !cut.type))
		abort();
	return 0;
}
