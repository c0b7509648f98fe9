/* The reader of OBJ and every stage of the import behind it. */
#include "tests/fuzz/mesh.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	return fuzz_mesh(bytes, size, MESH_OBJ);
}
