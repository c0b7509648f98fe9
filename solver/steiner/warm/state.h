/* The warm state: a dual of a whole graph. For the files of this folder. */
#ifndef SOLVER_STEINER_WARM_STATE_H
#define SOLVER_STEINER_WARM_STATE_H

#include "solver/steiner/search.h"
#include "solver/steiner/warm/warm.h"

/* Names a vertex for good: a lasting one by its number, another by the caller's name for it, with the upper bit set. */
typedef uint64_t warm_key;

struct warm_memory;

/* A dual as potentials: a lane for each terminal but the root. What the balls of a terminal prove, their sum proves as
 * well: p[v], the sum of min(distance, radius), takes max(0, p[u] - p[v]) from the arc u -> v and adds p[root] to the
 * bound. Row r < lasting_count is that vertex's, others are those of extra_key. */
struct steiner_warm {
	size_t budget;
	struct arena *arena; /* owned; holds what follows down to `loss`. NULL: there is no state */
	uint32_t lasting_count;
	uint32_t extra_count;
	warm_key *extra_key; /* [extra_count] */
	unsigned coarse_shift;
	warm_key root;
	uint32_t lane_count;
	uint32_t stride; /* row length: lane_count and padding, which is 0 */
	warm_key *lane;  /* [lane_count] the lanes' terminals */
	/* [(lasting_count + extra_count) * stride] coarse, 0 to the root's; WARM_UNKNOWN at the beginning of the rows
	 * of vertices that the graph had no way to. */
	int32_t *potential;

	struct warm_memory *memory; /* of the flow that it came from; NULL where it does not fit */
	fine_t loss;                /* of the dual's bound against the optimum */
	bool is_due;
};

enum { WARM_LANES = 4, WARM_UNKNOWN = -1 };

/* How many vertices of the graph last: the first ones. */
static inline uint32_t warm_lasting(const struct search *search)
{
	const struct steiner_options *options = search->options;
	return options->vertex_name ? options->lasting_count : search->graph->vertex_count;
}

/* The key of a vertex of the caller's graph. */
static inline warm_key warm_key_of(const struct search *search, uint32_t vertex)
{
	const uint32_t lasting = warm_lasting(search);
	return vertex < lasting ? vertex : search->options->vertex_name[vertex - lasting] | UINT64_C(1) << 63;
}

/* The row of the vertex with this key; INSTANCE_NONE: the state does not know it. */
uint32_t warm_row_of(const struct steiner_warm *warm, warm_key key);

/* The caller's vertices behind those of an instance without reductions: vertex_of [instance's vertex_count]. */
void warm_name_vertices(const struct search *search, uint32_t *vertex_of);

#endif
