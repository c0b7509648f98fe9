/* Purpose: the life of a warm state, and the names by which it knows vertices. */
#include "solver/steiner/warm/state.h"

#include <stdlib.h>

struct steiner_warm *steiner_warm_new(size_t budget)
{
	struct steiner_warm *warm = calloc(1, sizeof *warm);
	if (warm)
		warm->budget = budget;
	return warm;
}

void steiner_warm_free(struct steiner_warm *warm)
{
	if (!warm)
		return;
	arena_free(warm->arena);
	free(warm);
}

size_t steiner_warm_bytes(const struct steiner_warm *warm)
{
	return sizeof *warm + (warm->arena ? arena_used(warm->arena) : 0);
}

bool steiner_warm_is_ready(const struct steiner_warm *warm)
{
	return warm->arena != NULL;
}

bool steiner_warm_is_due(const struct steiner_warm *warm)
{
	return warm->is_due;
}

void warm_name_vertices(const struct search *search, uint32_t *vertex_of)
{
	const struct instance *instance = &search->instance;
	for (uint32_t e = 0; e < instance->edge_count; e++)
		for (uint32_t side = 0; side < 2; side++)
			vertex_of[instance->ends[2 * e + side]] = search->graph->ends[2 * instance->origin[e] + side];
}

uint32_t warm_row_of(const struct steiner_warm *warm, warm_key key)
{
	if (key < warm->lasting_count)
		return (uint32_t)key;
	for (uint32_t i = 0; i < warm->extra_count; i++)
		if (warm->extra_key[i] == key)
			return warm->lasting_count + i;
	return INSTANCE_NONE;
}
