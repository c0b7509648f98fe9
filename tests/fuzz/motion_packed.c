/* A packed motion. The service says how many points it expects; here any number will do that a small garment could
 * have, since memory for more takes longer to get than the rest. */
#include "tests/fuzz/motion.h"

enum { POINTS_AT = 1 + 8 };

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (size >= POINTS_AT + 4 && (bytes[POINTS_AT + 1] >> 4 || bytes[POINTS_AT + 2] || bytes[POINTS_AT + 3]))
		return 0;
	return fuzz_motion(bytes, size, MOTION_PACKED);
}
