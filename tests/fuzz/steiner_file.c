/* Any bytes as a Steiner instance: read, and what is accepted must be a graph that holds its promises. */
#include "solver/graph/steiner_file.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int holds)
{
	if (!holds)
		abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct arena *arena = arena_new((size_t)256 << 20);
	if (!arena)
		return 0;
	struct steiner_file file;
	struct tw_error error = {0};
	if (steiner_file_read(&file, arena, (const char *)data, size, &error) == TW_OK) {
		const struct graph *graph = &file.graph;
		check(file.terminal_count > 0 && graph->first[graph->vertex_count] == 2 * graph->edge_count);
		for (uint32_t i = 0; i < file.terminal_count; i++)
			check(file.terminals[i] < graph->vertex_count);
		for (uint32_t e = 0; e < graph->edge_count; e++)
			check(graph->ends[2 * e] < graph->vertex_count && graph->ends[2 * e] != graph->ends[2 * e + 1]);
	} else {
		check(error.status != TW_OK && *error.text);
	}
	arena_free(arena);
	return 0;
}
