/* A motion as MDD. */
#include "tests/fuzz/motion.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	return fuzz_motion(bytes, size, MOTION_MDD);
}
