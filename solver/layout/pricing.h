/* What wires cost in this layout: the field, or the field weighed anew with another eta or with a request's
 * constraints, and the network with these weights. */
#ifndef SOLVER_LAYOUT_PRICING_H
#define SOLVER_LAYOUT_PRICING_H

#include "solver/layout/chords.h"
#include "solver/layout/ground.h"
#include "solver/layout/network.h"
#include "solver/steiner/steiner.h"

struct pricing {
	const struct field *field; /* the input's, or `own` */
	struct field own;
	const struct field_constraints *constraints; /* the ground's */
	struct network network;
	struct chord_graph chords;
	bool has_chords;           /* the tree may use them */
	const struct graph *graph; /* that trees are searched in: the network's or that with chords */
	/* Integrates density + eta alone, without a request's multipliers: what a wire deforms, whatever it costs. */
	struct strip_walker *walker;
	struct strip_fabric fabric;
	struct strip_walker *keep_out_walker; /* integrates 1 over what is kept out; NULL without keep-outs */
	struct strip_fabric keep_out_fabric;
};

/* `eta_mpa`: NaN for the field's own. Borrows everything. `pricing` must stay where it is. TW_ERROR_INPUT,
 * TW_ERROR_MEMORY. */
enum tw_status pricing_build(struct pricing *pricing, struct arena *arena, const struct ground *ground,
			     const struct site_set *sites, double eta_mpa, struct tw_error *error) TW_NODISCARD;

/* One search for a tree. */
struct pricing_search {
	const struct graph *graph; /* the network's, or that with other weights */
	uint64_t work_limit;       /* as in steiner_options */
	double time_share;         /* of the request's time limit */
	struct steiner_warm *warm; /* as in steiner_options; NULL: from scratch */
	void (*progress)(void *context, const struct steiner_progress *progress); /* may be NULL */
	void *context;                                                            /* borrowed, handed to it */
};

/* Solves for the tree; TW_ERROR_CANCELLED, or TW_ERROR_INPUT "terminals-apart" where constraints leave no way. */
enum tw_status pricing_solve(const struct pricing *pricing, struct arena *arena, const struct layout_input *input,
			     const struct pricing_search *search, struct steiner_tree *tree,
			     struct tw_error *error) TW_NODISCARD;

/* What a search for a tree is told beside graph and terminals: everything of the options but its callbacks. */
struct steiner_options pricing_options(const struct pricing *pricing, const struct layout_input *input,
				       const struct pricing_search *search);

/* How much of a search is done, 0…1: how near bound and tree are. */
double pricing_solved(const struct steiner_progress *progress);

/* The eta at which, for these terminals, the normalised curves of length (falling with eta) and deformation energy
 * (rising) cross (method 3), to three digits. Costs some ten searches, which share the request's time limit;
 * `progress` hears their share, 0…1. Scratch memory goes back to the arena. */
enum tw_status pricing_balance(double *eta_mpa, struct arena *arena, const struct ground *ground,
			       const struct site_set *sites, void (*progress)(void *context, double share),
			       void *context, struct tw_error *error) TW_NODISCARD;

#endif
