/* Exact Steiner trees: the minimum-weight tree of a graph that spans given terminals, with a proof.
 *
 * Deterministic: effort is counted in work units, so equal input and options give equal trees, bounds and statistics on
 * every machine and for every number of threads; only `time_limit_s` and `cancelled` bring the clock in. No globals. */
#ifndef SOLVER_STEINER_STEINER_H
#define SOLVER_STEINER_STEINER_H

#include "solver/arena.h"
#include "solver/graph/graph.h"
#include "tightwire.h"

#include <stdbool.h>

enum steiner_outcome {
	STEINER_OPTIMAL,    /* the tree is a minimum: lower_bound == weight. is_unique says which of several */
	STEINER_LIMIT,      /* a time, work or memory limit ended the search: best tree found, proven lower bound */
	STEINER_CANCELLED,  /* `cancelled` said so: likewise */
	STEINER_INFEASIBLE, /* the terminals do not lie in one component: no tree; terminal_a and terminal_b are apart
			     */
};

/* What can be switched off for a test; the weight of the tree must stay the same. */
enum steiner_feature {
	STEINER_REDUCTIONS = 1 << 0,   /* general reductions: degree, special distance */
	STEINER_PRIMAL = 1 << 1,       /* primal heuristics beyond the first tree */
	STEINER_REASCENT = 1 << 2,     /* drop and re-ascend in the dual */
	STEINER_FIXING = 1 << 3,       /* deletion by reduced costs */
	STEINER_SEPARATORS = 1 << 4,   /* separator pruning in the dynamic program */
	STEINER_FUTURE_COST = 1 << 5,  /* label pruning by the dual bound */
	STEINER_GUESSING = 1 << 6,     /* guessed upper bounds */
	STEINER_GUIDE = 1 << 7,        /* a tree that guides the growth of the dual */
	STEINER_CUTS = 1 << 8,         /* branch and cut */
	STEINER_PERTURBATION = 1 << 9, /* breaking of ties by fine weights; without, options.ties is not looked at */
	STEINER_DYNAMIC = 1 << 10,     /* dynamic programming (then branch and cut must do it) */
	STEINER_FLOW = 1 << 11,        /* the flow dual; without, local search on the dual */
	STEINER_EARLY = 1 << 12,       /* the first attempt at a proof, before bounds and trees get better */
	STEINER_PARTS = 1 << 13,       /* trees of parts of the instance, which are solved as ones of their own */
};

/* What is known so far; the tree is valid, borrowed, and good for the duration of the call. */
struct steiner_progress {
	uint64_t weight;      /* of the best tree so far, UINT64_MAX for none */
	uint64_t lower_bound; /* proven */
	const uint32_t *edges;
	uint32_t edge_count;
	uint64_t work;     /* units spent */
	const char *stage; /* borrowed, static: "dual ascent" */
};

struct steiner_warm;

struct steiner_options {
	double time_limit_s; /* wall clock; 0 for none. Makes the answer depend on the machine */
	uint64_t work_limit; /* work units; 0 for none. Deterministic */
	size_t memory_limit; /* bytes of scratch memory; 0 for none. Deterministic */
	unsigned threads;    /* that grow terminal sets; 0 and 1: the calling one only. Never changes the answer: helper
				threads end when half of memory_limit is used up, and what they hold does not count */
	/* [graph->edge_count] borrowed; may be NULL. With it the optimum is unique by construction: of the lightest
	 * trees the one of least sum of tie-breaks. Good ones are hashes of where an edge lies, which know no
	 * numbering; two trees that agree in both sums are as unlikely as hashes of 32 bits can make it. Without, any
	 * lightest tree. */
	const uint32_t *ties;
	/* What an earlier search left, to start from, and what this one leaves; may be NULL. Never changes a proven
	 * answer. Only looked at where there are ties. warm/warm.h */
	struct steiner_warm *warm;
	/* For `warm`: vertices below lasting_count are the same in all its searches; another, v, is the same as any of
	 * the same name vertex_name[v - lasting_count]. vertex_name NULL: all last. */
	uint32_t lasting_count;
	const uint64_t *vertex_name; /* borrowed */
	uint64_t disable; /* set of enum steiner_feature bits switched off, for tests: the value must stay the same */
	/* Called from the calling thread, at stage ends and at most some times a second; may be NULL. */
	void (*progress)(void *context, const struct steiner_progress *progress);
	/* Polled every few milliseconds; a true answer ends the search with the best known. May be NULL. */
	bool (*cancelled)(void *context);
	void *context; /* borrowed, handed to both */
};

struct steiner_stats {
	uint64_t work;          /* units */
	uint64_t labels;        /* labels the dynamic program kept */
	uint64_t sets;          /* terminal sets it handled */
	uint64_t branch_nodes;  /* of the fallback, 0 where it was not needed */
	uint32_t vertices_left; /* after reductions and fixing */
	uint32_t edges_left;
	size_t memory_peak; /* bytes of scratch memory */
	bool is_from_warm;  /* the warm state led to the proof; the rest is of that search alone */
	double seconds_reduce, seconds_dual, seconds_primal, seconds_exact,
		seconds_total; /* wall clock; never in result bytes */
};

struct steiner_tree {
	enum steiner_outcome outcome;
	uint64_t weight;      /* sum of the edges' weights */
	uint64_t lower_bound; /* proven; equals weight when optimal */
	uint32_t *edges;      /* [edge_count] edge indices of the graph, ascending; borrowed from the caller's arena */
	uint32_t edge_count;
	bool is_unique; /* optimal, and of least sum of options.ties: proven, too */
	/* The tree and the bound are the same on every machine: no clock, no cancelling and no pivot of a linear
	 * program, which is another library's arithmetic, had a part in them. */
	bool is_reproducible;
	uint32_t terminal_a, terminal_b; /* infeasible: two terminal vertices in different components */
	struct steiner_stats stats;
};

/* Solves. `terminals`: [terminal_count] vertex indices, equal ones allowed. The tree's edges are allocated from
 * `arena`, scratch memory is the function's own. Every tree passes steiner_verify before it leaves. TW_ERROR_INPUT for
 * no terminals or one out of range; TW_ERROR_MEMORY only when not even a first tree fits; limits are outcomes. */
enum tw_status steiner_solve(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			     const struct steiner_options *options, struct arena *arena, struct steiner_tree *tree,
			     struct tw_error *error) TW_NODISCARD;

/* The independent check, which shares nothing with the solver: the edges are distinct, form one tree without a cycle,
 * span all terminals, have no leaf that is not a terminal, and their weights sum to `weight`. TW_ERROR_INTERNAL names
 * what is wrong. */
enum tw_status steiner_verify(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			      const uint32_t *edges, uint32_t edge_count, uint64_t weight,
			      struct tw_error *error) TW_NODISCARD;

#endif
