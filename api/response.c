#include "api/response.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

void response_clear(struct api_response *response)
{
	for (size_t i = 0; i < response->header_count; i++)
		free(response->headers[i].value);
	free(response->bytes);
	if (response->stream)
		response->stream->close(response->stream);
	*response = (struct api_response){0};
}

static bool is_header_text(const char *text)
{
	for (; *text; text++)
		if ((unsigned char)*text < ' ' || *text == 127)
			return false;
	return true;
}

static struct api_header *header_slot(struct api_response *response, const char *name)
{
	for (size_t i = 0; i < response->header_count; i++)
		if (!strcasecmp(response->headers[i].name, name))
			return &response->headers[i];
	if (response->header_count == API_HEADERS_MAX)
		return NULL;
	struct api_header *slot = &response->headers[response->header_count++];
	*slot = (struct api_header){.name = name};
	return slot;
}

void response_header(struct api_response *response, const char *name, const char *format, ...)
{
	char *value = NULL;
	va_list arguments;
	va_start(arguments, format);
	int length = vasprintf(&value, format, arguments);
	va_end(arguments);
	if (length < 0)
		return;
	struct api_header *slot = is_header_text(value) ? header_slot(response, name) : NULL;
	if (!slot) {
		free(value);
		return;
	}
	free(slot->value);
	slot->value = value;
}

const char *response_get_header(const struct api_response *response, const char *name)
{
	for (size_t i = 0; i < response->header_count; i++)
		if (!strcasecmp(response->headers[i].name, name))
			return response->headers[i].value;
	return NULL;
}

enum tw_status response_json(struct api_response *response, unsigned status, json_t *json, struct tw_error *error)
{
	char *text = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	if (!text)
		return tw_fail_memory(error);
	return response_bytes(response, status, "application/json", text, strlen(text), error);
}

enum tw_status response_bytes(struct api_response *response, unsigned status, const char *media_type, char *bytes,
			      size_t size, struct tw_error *error)
{
	if (!bytes)
		return tw_fail_memory(error);
	free(response->bytes);
	response->bytes = bytes;
	response->size = size;
	response->status = status;
	response_header(response, "Content-Type", "%s", media_type);
	return TW_OK;
}

void response_stream(struct api_response *response, const char *media_type, struct api_stream *stream)
{
	response->stream = stream;
	response->status = 200;
	response_header(response, "Content-Type", "%s", media_type);
}

void response_empty(struct api_response *response, unsigned status)
{
	response->status = status;
}
