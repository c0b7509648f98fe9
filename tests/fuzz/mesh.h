/* What the fuzz targets of the mesh formats share: the format's reader and every stage of the import behind it. Inputs
 * of an even size are worn mesh and flat pattern in one: not every format can hold a pattern beside the worn mesh. */
#ifndef TESTS_FUZZ_MESH_H
#define TESTS_FUZZ_MESH_H

#include "solver/garment/import.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static inline int fuzz_mesh(const uint8_t *bytes, size_t size, enum mesh_format format)
{
	struct arena *arena = arena_new((size_t)256 << 20);
	if (!arena)
		return 0;
	struct garment_source source = {.bytes = bytes, .size = size, .format = format};
	struct import_options options;
	option_defaults(&import_option_table, &options);
	options.mirrored_pieces = MIRRORED_TURN;
	options.weld_mm = size / 2 % 2 ? 0.5 : 0;
	options.refinement = size % 3 ? REFINE_NONE : REFINE_MIDPOINT;
	struct garment garment;
	struct garment_report report;
	struct tw_error error = {0};
	if (garment_import(&garment, arena, &source, size % 2 ? NULL : &source, &options, &report, &error) != TW_OK &&
	    !error.type)
		__builtin_trap();
	arena_free(arena);
	return 0;
}

#endif
