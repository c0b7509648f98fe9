/* A strand at work: what its stages hand to one another while wires are smoothed (wires.c). */
#ifndef SOLVER_LAYOUT_DRAFT_H
#define SOLVER_LAYOUT_DRAFT_H

#include "solver/layout/unfold.h"
#include "solver/layout/wire_set.h"
#include "solver/pattern/outline.h"

/* What all strands of a layout share. */
struct smoother {
	struct wire_set *wires;
	struct arena *arena;
	const struct network *network;
	const struct branch_set *set;
	const struct outline *outline;
	const struct locator *locator;
	const struct wire_rules *rules;
	const double *cost_per_mm;
	const double *vertex_rate; /* [vertex_count] mean cost_per_mm of the edges at a vertex; NULL without costs */
	bool *end_known;           /* [end_count] */
};

/* One strand at work. */
struct draft {
	struct smoother *smoother;
	const struct strand *strand;
	struct unfolded path;
	bool extended_first;    /* a node was put before the strand's own first */
	bool *stop;             /* [path.count] */
	bool *junction;         /* [path.count] another strand ends here */
	double *rate;           /* [path.count] */
	struct vec2 (*tree)[2]; /* [path.count - 1] the tree's own path, leg by leg, in the strand's plane */
	double tolerance_mm; /* of straightening; less than the rules' makes for a curve that is nearer to the path */
	struct span *span;   /* in the strand's plane; a span's piece is its run */
	uint32_t span_count;
	double badness; /* mm by which the curve breaks rules, summed up; 0 for none */
};

/* A point of the strand's plane in the plane of the piece that a run lies in. */
static inline struct vec2 draft_in_piece(const struct draft *draft, uint32_t run, struct vec2 point)
{
	return placement_undo(draft->path.run[run].placement, point);
}

/* The tolerance that is held while curves are looked at in steps: between them they may stray a little more. */
static inline double draft_held_mm(const struct draft *draft)
{
	return 0.98 * draft->smoother->rules->tolerance_mm;
}

/* How far a point of the strand's plane is from legs first…end - 1 of the tree's own path. */
double draft_stray(const struct draft *draft, uint32_t first, uint32_t end, struct vec2 point);

/* Straightens the path and rounds its corners: sets `span`, `span_count` and `badness`. TW_ERROR_MEMORY. */
enum tw_status draft_draw(struct draft *draft, struct tw_error *error) TW_NODISCARD;

#endif
