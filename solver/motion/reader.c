#include "solver/motion/reader.h"

enum tw_status reader_read(struct motion_reader *reader, void *bytes, size_t size, size_t *got, struct tw_error *error)
{
	*got = 0;
	while (*got < size) {
		size_t part = 0;
		enum tw_status status =
			reader->source.read(reader->source.context, (char *)bytes + *got, size - *got, &part, error);
		if (status != TW_OK)
			return status;
		if (part == 0)
			break;
		*got += part;
	}
	return TW_OK;
}

enum tw_status reader_truncated(const struct motion_reader *reader, struct tw_error *error)
{
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	return tw_fail(error, TW_ERROR_INPUT, "motion-truncated", where,
		       "the file ends within frame %u (counted from 0); send it whole", reader->frame);
}

enum tw_status reader_fill(struct motion_reader *reader, void *bytes, size_t size, struct tw_error *error)
{
	size_t got = 0;
	enum tw_status status = reader_read(reader, bytes, size, &got, error);
	return status != TW_OK ? status : got < size ? reader_truncated(reader, error) : TW_OK;
}

enum tw_status reader_check_counts(const struct motion_reader *reader, int64_t vertices, int64_t frames,
				   struct tw_error *error)
{
	if (vertices < 1 || frames < 1)
		return tw_fail(
			error, TW_ERROR_INPUT, "motion-empty", NULL,
			"the header says %lld vertices and %lld frames; export the motion with at least one of each",
			(long long)vertices, (long long)frames);
	if (reader->expected > 0 && vertices != reader->expected)
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-count", NULL,
			       "the motion has %lld vertices, the garment's file %u; export both from the same mesh",
			       (long long)vertices, reader->expected);
	if (vertices > TW_LIMIT_VERTICES || frames > TW_LIMIT_FRAMES)
		return tw_fail(error, TW_ERROR_LIMIT, "motion-too-large", NULL,
			       "the header claims %lld vertices and %lld frames; at most %u and %u are accepted",
			       (long long)vertices, (long long)frames, TW_LIMIT_VERTICES, TW_LIMIT_FRAMES);
	return TW_OK;
}

enum tw_status reader_check(const struct motion_reader *reader, int64_t vertices, int64_t frames, uint64_t header,
			    uint64_t per_frame, struct tw_error *error)
{
	enum tw_status status = reader_check_counts(reader, vertices, frames, error);
	if (status != TW_OK)
		return status;
	uint64_t size = header + (uint64_t)frames * per_frame;
	if (reader->source.size == UINT64_MAX || reader->source.size == size)
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, reader->source.size < size ? "motion-truncated" : "motion-trailing-bytes",
		       NULL,
		       "the header describes %llu bytes (%lld frames of %lld vertices), the file has %llu; export or "
		       "send it again, whole",
		       (unsigned long long)size, (long long)frames, (long long)vertices,
		       (unsigned long long)reader->source.size);
}

enum tw_status reader_expect_end(struct motion_reader *reader, struct tw_error *error)
{
	char byte;
	size_t got = 0;
	enum tw_status status = reader_read(reader, &byte, 1, &got, error);
	if (status != TW_OK || got == 0)
		return status;
	return tw_fail(error, TW_ERROR_INPUT, "motion-trailing-bytes", NULL,
		       "there are bytes behind the last of %u frames; the header and the file disagree",
		       reader->info.frame_count);
}
