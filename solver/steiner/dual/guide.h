/* The tree that guides the dual: the best one, hanging from the root.
 *
 * Complementary slackness: for a tree T directed away from the root, weight(T) - bound is the sum of two losses, the
 * costs that are left on the arcs of T, and, for every cut, its value times the number of arcs beyond the first by
 * which T enters it. An ascent that knows a light tree can avoid the second: a ball stops growing as soon as it cuts
 * the tree in two parts, and waits until the balls of other terminals have made the way between the parts free. Any
 * tree will do for a sound bound, because it only chooses the order of growth. */
#ifndef SOLVER_STEINER_DUAL_GUIDE_H
#define SOLVER_STEINER_DUAL_GUIDE_H

#include "solver/steiner/search.h"

struct dual_guide {
	uint32_t count;   /* vertices of the tree; 0: there is no guide */
	uint32_t *vertex; /* [count] each after its parent */
	uint32_t *first;  /* [vertex_count + 1] rows of next */
	uint32_t *next;   /* neighbours in the tree */
	uint32_t *parent; /* [vertex_count] INSTANCE_NONE at the root and outside of the tree */
};

/* Room for a tree of search->instance, from search->arena; no guide yet. TW_ERROR_MEMORY. */
enum tw_status dual_guide_allocate(struct dual_guide *guide, struct search *search) TW_NODISCARD;

/* Makes the best tree the guide, hanging from the vertex `root`; there is none when the instance does not hold all of
 * the tree, or when guiding is switched off. TW_ERROR_MEMORY only. */
enum tw_status dual_guide_set(struct dual_guide *guide, struct search *search, uint32_t root) TW_NODISCARD;

/* In how many parts a ball cuts the guide, counted while its vertices are settled one by one: what v adds. Each part is
 * entered by one arc of the guide. inside[vertex]: settled before. */
static inline int32_t dual_guide_parts(const struct dual_guide *guide, const uint8_t *inside, uint32_t v)
{
	int32_t parts = guide->first[v + 1] > guide->first[v];
	for (uint32_t i = guide->first[v]; i < guide->first[v + 1]; i++)
		parts -= inside[guide->next[i]];
	return parts;
}

#endif
