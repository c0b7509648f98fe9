/* A layout: the wiring tree of least strain energy between given terminals, smoothed into curves that can be cut and
 * pressed, with its metrics beside those of a baseline (method 4 to 7).
 *
 * Deterministic: equal input gives equal artifact bytes on every machine and for every number of threads, unless the
 * request sets a time limit. No ids, times or paths stand in the artifacts. */
#ifndef SOLVER_LAYOUT_LAYOUT_H
#define SOLVER_LAYOUT_LAYOUT_H

#include "solver/arena.h"
#include "solver/garment/garment.h"
#include "solver/layout/request.h"
#include "solver/layout/summary.h"
#include "tightwire.h"

struct field;
struct motion_reader;

/* What is known so far of the running computation. */
struct layout_progress {
	const char *stage; /* borrowed, static: "terminals", "eta", "tree", "baseline", "curves", "elongation",
			      "artifacts" */
	double share;      /* 0…1 of the whole, a rough guess */
	uint64_t weight;   /* of the best tree so far, in weight units of the field; UINT64_MAX for none */
	uint64_t lower_bound;
};

struct layout_input {
	const struct garment *garment;
	const struct topology *topology;
	const struct field *field; /* of this garment */
	const struct layout_request *request;
	const char *const *motion_name; /* [motion_count] for the report; may be NULL when motion_count is 0 */
	uint32_t motion_count;          /* motions whose frames give the elongation; 0 for none */
	unsigned threads;               /* 0 and 1: the calling thread only. Never changes the answer */
	size_t memory_limit;            /* bytes of scratch memory for the Steiner search; 0 for none */
	/* Opens the frames of a motion, positioned at its first frame; layout_compute closes it with motion_close. Only
	 * called where motion_count > 0 and the request asks for the elongation; one motion is open at a time. */
	enum tw_status (*motion_open)(void *context, uint32_t motion, struct motion_reader **reader,
				      struct tw_error *error);
	void (*progress)(void *context, const struct layout_progress *progress); /* may be NULL */
	int (*cancelled)(void *context);                                         /* may be NULL */
	void *context;                                                           /* borrowed, handed to all three */
};

/* A file that the layout gives. */
struct layout_artifact {
	const char *name;       /* borrowed, static: "layout.json", "pattern.svg", "suit.svg" */
	const char *media_type; /* borrowed, static */
	const char *bytes;      /* borrowed from the caller's arena; a NUL stands behind the last byte */
	size_t size;
};

enum { LAYOUT_ARTIFACTS_MAX = 8 };

struct layout_output {
	struct layout_artifact artifacts[LAYOUT_ARTIFACTS_MAX];
	uint32_t artifact_count;
	struct layout_summary summary;
};

/* Computes the layout. All of *output is allocated from `arena`. TW_ERROR_INPUT names the terminal that cannot be
 * placed
 * ("terminal-out-of-range", "terminal-off-fabric", "terminal-unknown-piece", "terminals-apart", where: JSON Pointer
 * into the request); TW_ERROR_CANCELLED when `cancelled` said so; TW_ERROR_MEMORY. A time limit that was reached is no
 * error: the summary's outcome is STEINER_LIMIT and the bound says how far off the tree can be. */
enum tw_status layout_compute(const struct layout_input *input, struct arena *arena, struct layout_output *output,
			      struct tw_error *error) TW_NODISCARD;

#endif
