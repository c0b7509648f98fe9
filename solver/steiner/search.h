/* What all stages share beside the instance: limits, effort, the best tree and the proven bound. */
#ifndef SOLVER_STEINER_SEARCH_H
#define SOLVER_STEINER_SEARCH_H

#include "solver/steiner/instance.h"
#include "solver/steiner/steiner.h"

enum search_stop { SEARCH_GOES_ON, SEARCH_LIMIT, SEARCH_CANCELLED, SEARCH_MEMORY };

struct search {
	const struct graph *graph; /* borrowed: the caller's */
	const uint32_t *terminals; /* borrowed: the caller's */
	uint32_t terminal_count;
	const struct steiner_options *options; /* borrowed */
	struct steiner_stats *stats;           /* borrowed */
	struct arena *arena;      /* owned by steiner_solve; scratch of all stages, taken and released like a stack */
	struct instance instance; /* the current one */

	uint64_t best_weight; /* the caller's units; UINT64_MAX until there is a tree */
	/* Only a tree below it is a better one: the best tree's fine weight where the caller breaks ties, else its
	 * weight in fine units. FINE_MAX until there is a tree. */
	fine_t best_fine;
	uint32_t *best_edges; /* [best_count] the caller's edges */
	uint32_t best_count;
	uint64_t lower_bound; /* the caller's units; proven */
	fine_t proven;        /* no tree below it is left to be found; in whole units unless the caller breaks ties */

	/* Fine, with instance.base: the current instance need only keep trees below it; FINE_MAX: no guess. */
	fine_t assumed;
	uint64_t work;       /* units spent: about one for each arc that is looked at */
	uint64_t next_poll;  /* work at which clock and `cancelled` are asked again */
	uint64_t budget_end; /* work at which the stage must give up, though the search goes on; 0: none */
	double started_s, last_progress_s;
	bool is_part;           /* its bounds hold for a part of the caller's graph: nothing is reported */
	bool has_pivoted;       /* a linear program had a part in the search */
	bool met_clock;         /* so had the clock or the caller's `cancelled` */
	enum search_stop stop;  /* why the stages must come to an end */
	const char *stage;      /* static: "dual ascent" */
	struct tw_error *error; /* borrowed; may be NULL */
};

/* A search that has not begun: no arena, no instance, no tree. Borrows everything. */
void search_init(struct search *search, const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
		 const struct steiner_options *options, struct steiner_stats *stats, struct tw_error *error);

/* Counts effort. False when the search must stop: the stage then returns TW_ERROR_CANCELLED at once. Call it at least
 * every 100,000 units; it is cheap. */
static inline int search_spend(struct search *search, uint64_t units);

/* Offers a set of edges of the instance (or, for search_offer_leaves, of the caller's graph) that connects the
 * terminals. It is expanded, made a tree, pruned to the terminals, checked by steiner_verify and kept when it is
 * lighter than the best. Returns TW_ERROR_MEMORY, or TW_ERROR_INTERNAL for a set that does not connect them. */
enum tw_status search_offer(struct search *search, const uint32_t *edges, uint32_t edge_count) TW_NODISCARD;
enum tw_status search_offer_leaves(struct search *search, const uint32_t *edges, uint32_t edge_count) TW_NODISCARD;

/* Marks the edges of the instance that belong to the best tree: is_best[edge_count] becomes 0 or 1. Deletions and
 * reductions may have left only a part of the tree. TW_ERROR_MEMORY only. */
enum tw_status search_mark_best(struct search *search, uint8_t *is_best) TW_NODISCARD;

/* Reports a lower bound on the fine weight of the instance's trees (without instance.base). Under a guess it proves no
 * more than the guess. */
void search_bound(struct search *search, fine_t fine_bound);

/* No tree better than the best one is left. */
void search_close(struct search *search);

/* Only trees of the instance with a fine weight (without instance.base) below this are better than the best one and
 * within the guess: what reaches it can be cut off. FINE_MAX while there is no tree. */
fine_t search_cutoff(const struct search *search);

/* The fine weight (without instance.base) that the proven bound is worth. */
fine_t search_proven(const struct search *search);

/* True when best tree and bound have met: no better tree is left. */
bool search_is_proven(const struct search *search);

/* True when no tree weighs less than the best one, though another of the same weight may have less of tie-breaks. */
bool search_is_lightest(const struct search *search);

/* True when the caller breaks ties, so that trees of equal weight differ. */
static inline bool search_breaks_ties(const struct search *search)
{
	return search->instance.ties != NULL;
}

/* Begins a search of its own, to find trees, in the part of the instance that the edges with keep[edge] != 0 make,
 * which must connect the terminals. It starts with the best tree, has the same limits, and proves nothing about the
 * whole. `stats` is its own. Everything is allocated from the arena. */
enum tw_status search_open_part(struct search *part, const struct search *whole, const uint8_t *keep,
				struct steiner_stats *stats) TW_NODISCARD;

/* Ends it: counts its work, and takes its best tree over if that is better. */
enum tw_status search_close_part(const struct search *part, struct search *whole) TW_NODISCARD;

/* Monotonic clock: for limits, progress and statistics only. */
double search_clock_s(void);

/* Names the stage for progress reports, and reports. */
void search_enter(struct search *search, const char *stage);

/* True when a feature is not switched off. */
static inline int search_uses(const struct search *search, enum steiner_feature feature)
{
	return !(search->options->disable & feature);
}

/* Gives the stages from here on `units` of work, 0 for as much as they want: then search_spend is false, and they
 * return TW_ERROR_CANCELLED while search->stop says that the search goes on. */
static inline void search_set_budget(struct search *search, uint64_t units)
{
	search->budget_end = units ? search->work + units : 0;
	search->next_poll = search->stop ? 0 : search->work;
}

int search_poll(struct search *search); /* for search_spend only */

static inline int search_spend(struct search *search, uint64_t units)
{
	search->work += units;
	return search->work < search->next_poll || search_poll(search);
}

#endif
