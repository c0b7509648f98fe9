/* The array: eta, of each tree TREE_HEAD numbers, then the edges of both. */
#include "solver/layout/trees.h"

#include <string.h>

enum { TREE_HEAD = 4, HEAD = 1 + 2 * TREE_HEAD };

static void put_head(uint64_t *at, const struct layout_tree *tree)
{
	at[0] = tree->is_optimal;
	at[1] = tree->weight;
	at[2] = tree->lower_bound;
	at[3] = tree->edge_count;
}

static uint64_t *put_edges(uint64_t *at, const struct layout_tree *tree)
{
	for (uint32_t i = 0; i < tree->edge_count; i++)
		*at++ = tree->edges[i];
	return at;
}

enum tw_status trees_to_array(const struct layout_trees *trees, struct arena *arena, struct tw_array *array,
			      struct tw_error *error)
{
	const size_t rows = HEAD + (size_t)trees->ours.edge_count + trees->baseline.edge_count;
	uint64_t *data = ARENA_ARRAY(arena, rows, uint64_t);
	if (!data)
		return tw_fail_memory(error);
	memcpy(data, &trees->eta_mpa, sizeof *data);
	put_head(data + 1, &trees->ours);
	put_head(data + 1 + TREE_HEAD, &trees->baseline);
	put_edges(put_edges(data + HEAD, &trees->ours), &trees->baseline);
	*array = (struct tw_array){.type = TW_U64, .columns = 1, .rows = rows, .data = data};
	return TW_OK;
}

static void take_head(const uint64_t *at, struct layout_tree *tree)
{
	tree->is_optimal = at[0];
	tree->weight = at[1];
	tree->lower_bound = at[2];
}

static enum tw_status take_edges(const uint64_t *at, uint64_t count, struct arena *arena, struct layout_tree *tree,
				 struct tw_error *error)
{
	uint32_t *edges = ARENA_ARRAY(arena, count, uint32_t);
	if (!edges)
		return tw_fail_memory(error);
	for (uint64_t i = 0; i < count; i++)
		edges[i] = (uint32_t)at[i];
	tree->edges = edges;
	tree->edge_count = (uint32_t)count;
	return TW_OK;
}

enum tw_status trees_from_array(struct layout_trees *trees, struct arena *arena, const struct tw_array *array,
				struct tw_error *error)
{
	const uint64_t *data = array->data;
	*trees = (struct layout_trees){0};
	bool fits = array->type == TW_U64 && array->columns == 1 && array->rows >= HEAD;
	uint64_t edges = fits ? array->rows - HEAD : 0;
	uint64_t ours = fits ? data[TREE_HEAD] : 0, baseline = fits ? data[2 * TREE_HEAD] : 0;
	if (!fits || edges > UINT32_MAX || ours > edges || baseline != edges - ours)
		return tw_fail(error, TW_ERROR_INTERNAL, "store-damaged", NULL, "the layout's trees are not readable");
	memcpy(&trees->eta_mpa, data, sizeof *data);
	take_head(data + 1, &trees->ours);
	take_head(data + 1 + TREE_HEAD, &trees->baseline);
	enum tw_status status = take_edges(data + HEAD, ours, arena, &trees->ours, error);
	return status == TW_OK ? take_edges(data + HEAD + ours, baseline, arena, &trees->baseline, error) : status;
}
