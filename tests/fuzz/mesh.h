/* What the fuzz targets of the mesh formats share: the format's reader and every stage of the import behind it. Inputs
 * of an even size are worn mesh and flat pattern in one: not every format can hold a pattern beside the worn mesh. */
#ifndef TESTS_FUZZ_MESH_H
#define TESTS_FUZZ_MESH_H

#include "solver/garment/import.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static inline int fuzz_mesh(const uint8_t *bytes, size_t size, enum mesh_format format)
{
	struct arena *arena = arena_new((size_t)256 << 20);
	if (!arena)
		return 0;
	const struct garment_source source = {.bytes = bytes, .size = size, .format = format};
	struct import_options options;
	option_defaults(&import_option_table, &options);
	options.mirrored_pieces = MIRRORED_TURN;
	options.weld_mm = size / 2 % 2 ? 0.5 : 0;
	options.refinement = size % 3 ? REFINE_NONE : REFINE_MIDPOINT;
	/* In the unit that makes a garment of it, so that the stages behind the check of units are reached. */
	for (options.unit = UNIT_MM; options.unit <= UNIT_M; options.unit++) {
		struct garment garment;
		struct garment_report report;
		struct tw_error error = {0};
		options.pattern_unit = options.unit;
		enum tw_status status =
			garment_import(&garment, arena, &source, size % 2 ? NULL : &source, &options, &report, &error);
		if (status != TW_OK && !error.type)
			__builtin_trap();
		if (status == TW_OK || strcmp(error.type, "mesh-unit") != 0)
			break;
	}
	arena_free(arena);
	return 0;
}

#endif
