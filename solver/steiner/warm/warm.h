/* What one search leaves for the next, where a designer drags a terminal: the next one starts near its proof.
 *
 * A state is prepared from a solved instance (steiner_warm_prepare) and serves searches on graphs with the same lasting
 * vertices whose terminals are mostly the same (steiner_options.warm). It only saves time: costs are read again, what
 * the state claims is checked against them, and only proven answers come of it. An answer that is unique has the same
 * bytes as from scratch. */
#ifndef SOLVER_STEINER_WARM_WARM_H
#define SOLVER_STEINER_WARM_WARM_H

#include "solver/steiner/steiner.h"

/* `budget`: bytes that a state may hold, 0 for no limit. NULL when out of memory. One state serves one search at a
 * time. Free with steiner_warm_free. */
struct steiner_warm *steiner_warm_new(size_t budget);
void steiner_warm_free(struct steiner_warm *warm); /* NULL is allowed */

/* Bytes held. */
size_t steiner_warm_bytes(const struct steiner_warm *warm);

/* Whether it holds anything. */
bool steiner_warm_is_ready(const struct steiner_warm *warm);

/* Whether the last search would have gained from a state prepared for it: there is none, or it has grown old. */
bool steiner_warm_is_due(const struct steiner_warm *warm);

/* Prepares the state anew for an instance that was just solved: `tree` is its optimum, unique under options->ties. Of
 * the options, names of vertices, ties, memory limit, threads and `cancelled` count. Takes about as long as a search
 * from scratch; a caller does it when nobody waits. A state that would not fit the budget is dropped.
 * TW_ERROR_CANCELLED: the state is what it was; TW_ERROR_MEMORY likewise. */
enum tw_status steiner_warm_prepare(struct steiner_warm *warm, const struct graph *graph, const uint32_t *terminals,
				    uint32_t terminal_count, const struct steiner_options *options,
				    const struct steiner_tree *tree) TW_NODISCARD;

#endif
