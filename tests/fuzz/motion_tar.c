/* A motion as a tar of OBJ files. Checksums would keep nearly every input from being read any further, so one bit of
 * the first byte asks for them to be put right. */
#include "tests/fuzz/motion.h"

#include <string.h>

enum { BLOCK = 512, CHECKSUM_AT = 148, CHECKSUM_BYTES = 8, MEND = 8 };

/* Whatever stands where a header could. */
static void mend_checksums(uint8_t *bytes, size_t size)
{
	for (size_t at = 0; at + BLOCK <= size; at += BLOCK) {
		uint8_t *header = bytes + at;
		unsigned sum = 0;
		char text[CHECKSUM_BYTES];
		if (memcmp(header + 257, "ustar", 5) != 0)
			continue;
		memset(header + CHECKSUM_AT, ' ', CHECKSUM_BYTES);
		for (size_t i = 0; i < BLOCK; i++)
			sum += header[i];
		snprintf(text, sizeof text, "%06o", sum);
		memcpy(header + CHECKSUM_AT, text, sizeof text);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (size == 0 || !(bytes[0] & MEND))
		return fuzz_motion(bytes, size, MOTION_OBJ_TAR);
	uint8_t *mended = malloc(size);
	if (!mended)
		return 0;
	memcpy(mended, bytes, size);
	mend_checksums(mended + 1, size - 1);
	fuzz_motion(mended, size, MOTION_OBJ_TAR);
	free(mended);
	return 0;
}
