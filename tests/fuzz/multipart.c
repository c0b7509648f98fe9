/* A form in two cuts, the whole at once and in pieces whose sizes the input chooses, gives the same parts. The first
 * two bytes choose the cut; the boundary is fixed, so that the fuzzer can find it. */
#include "api/multipart.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* FNV-1a over all that the sink is told, in which the cut of the data does not show. */
static uint64_t mix(uint64_t hash, const void *bytes, size_t size)
{
	for (size_t i = 0; i < size; i++)
		hash = (hash ^ ((const uint8_t *)bytes)[i]) * 1099511628211u;
	return hash;
}

static enum tw_status begin(void *context, const struct multipart_part *part, struct tw_error *error)
{
	uint64_t *hash = context;
	(void)error;
	*hash = mix(*hash, part->name, strlen(part->name) + 1);
	*hash = mix(*hash, part->file_name, strlen(part->file_name) + 1);
	*hash = mix(*hash, part->media_type, strlen(part->media_type) + 1);
	return TW_OK;
}

static enum tw_status take(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	uint64_t *hash = context;
	(void)error;
	*hash = mix(*hash, bytes, size);
	return TW_OK;
}

static enum tw_status end(void *context, struct tw_error *error)
{
	uint64_t *hash = context;
	(void)error;
	*hash = mix(*hash, "end", 4);
	return TW_OK;
}

static enum tw_status parse(const uint8_t *data, size_t size, size_t step, uint64_t *hash)
{
	struct multipart multipart;
	struct tw_error error;
	*hash = 14695981039346656037u;
	if (multipart_init(&multipart, "multipart/form-data; boundary=b",
			   (struct multipart_sink){begin, take, end, hash}, &error))
		abort();
	for (size_t at = 0; at < size; at += step) {
		enum tw_status status =
			multipart_feed(&multipart, data + at, step < size - at ? step : size - at, &error);
		if (status)
			return status;
	}
	return multipart_finish(&multipart, &error);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	uint64_t whole = 0, pieces = 0;
	if (size < 2)
		return 0;
	size_t step = 1 + (size_t)data[0] % 97;
	enum tw_status first = parse(data + 2, size - 2, size, &whole);
	if (first != parse(data + 2, size - 2, step, &pieces) || (!first && whole != pieces))
		abort();
	return 0;
}
