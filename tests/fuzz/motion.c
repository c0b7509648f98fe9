/* The readers of motions: the first byte chooses the format and whether the size is known. */
#include "solver/motion/motion.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (size == 0)
		return 0;
	struct byte_memory memory = {bytes + 1, size - 1, 0};
	struct byte_source source = byte_source_memory(&memory);
	if (bytes[0] & 8)
		source.size = UINT64_MAX;
	struct motion_reader *reader = NULL;
	struct tw_error error = {0};
	enum tw_status status =
		motion_open(&reader, &source, (enum motion_format)((bytes[0] & 7) % 5), UNIT_MM, 0, &error);
	if (status != TW_OK) {
		if (!error.type)
			__builtin_trap();
		return 0;
	}
	float *positions = malloc(12 * (size_t)motion_info(reader)->vertex_count);
	bool end = positions == NULL;
	for (int frame = 0; frame < 100 && status == TW_OK && !end; frame++)
		status = motion_next(reader, positions, &end, &error);
	if (status == TW_OK && positions)
		status = motion_rewind(reader, &error);
	if (status == TW_OK && positions)
		status = motion_next(reader, positions, &end, &error);
	free(positions);
	motion_close(reader);
	return 0;
}
