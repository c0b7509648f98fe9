/* Connects a few pieces of a broken tree as cheaply as can be: an exact dynamic program in the region between them. */
#ifndef SOLVER_STEINER_PRIMAL_CONNECT_H
#define SOLVER_STEINER_PRIMAL_CONNECT_H

#include "solver/steiner/heap.h"
#include "solver/steiner/search.h"

enum { PRIMAL_PIECES_MAX = 12 };

/* Workspace, allocated once for an instance; all arrays are borrowed from the arena. */
struct primal_connect {
	struct search *search; /* borrowed */
	uint8_t *allowed;      /* [vertex_count] the region may hold the vertex; the caller's to set; NULL: every one */

	/* The two nearest pieces of a vertex, valid where seen[v] == round. */
	uint32_t round;
	uint32_t *seen;                 /* [vertex_count] */
	struct primal_nearest *nearest; /* [vertex_count] */
	uint32_t *touched;              /* [vertex_count] the vertices seen in this round */
	uint32_t touched_count;
	struct heap heap;

	/* The region, numbered densely, with its own rows. */
	uint32_t region_count;
	uint32_t *vertex; /* [region_count] */
	uint32_t *local;  /* [vertex_count] number in the region, valid where the vertex is in it */
	uint32_t *first;  /* [region_count + 1] */
	struct primal_arc *arc;
	uint32_t arc_capacity;

	/* cost[set * region_count + v]: lightest way to connect the pieces of the set and v. */
	fine_t *cost;
	uint32_t *from; /* the same shape: how */
	size_t label_capacity;
	fine_t *distance; /* [pieces * region_count], from each piece; part of `cost` */
};

struct primal_nearest {
	fine_t distance[2];
	uint8_t piece[2];
	uint8_t settled;
};

struct primal_arc {
	uint32_t head; /* in the region */
	uint32_t tail;
	uint32_t edge; /* of the instance */
};

enum tw_status primal_connect_init(struct primal_connect *connect, struct arena *arena,
				   struct search *search) TW_NODISCARD;

/* Connects `piece_count` pieces: members[i] is a vertex of the piece pieces[i]. Writes the edges to `edges` (room for
 * vertex_count) and returns how many; 0 when there is nothing lighter than `limit`, or when the region is too large for
 * `region_max` vertices or the workspace. */
uint32_t primal_connect_pieces(struct primal_connect *connect, const uint32_t *members, const uint8_t *pieces,
			       uint32_t member_count, uint32_t piece_count, fine_t limit, uint32_t region_max,
			       uint32_t *edges);

#endif
