/* The loop that ties deletion and dynamic program together by guessed upper bounds. */
#ifndef SOLVER_STEINER_GUESS_H
#define SOLVER_STEINER_GUESS_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* Proves an optimum of search->instance, whose dual is `dual`. TW_ERROR_CANCELLED when the search, or its budget, ends;
 * what was proven until then stays. TW_ERROR_MEMORY. */
enum tw_status guess_solve(struct search *search, const struct dual *dual) TW_NODISCARD;

/* A single guess, for whoever chooses guesses by himself: from guess_begin to guess_end, which follows in any case, the
 * search works on a copy of its instance, and cuts off what is not below the guess. TW_ERROR_MEMORY. */
struct guess_saved {
	struct arena_mark mark;
	struct instance instance;
	fine_t assumed;
};
enum tw_status guess_begin(struct search *search, fine_t guess, struct guess_saved *saved) TW_NODISCARD;
void guess_end(struct search *search, const struct guess_saved *saved);

/* What no tree below the guess uses goes from search->instance, then the dynamic program. *found: 1 when it found the
 * lightest of the trees below the guess, else as before. Errors as dp_solve. */
enum tw_status guess_solve_below(struct search *search, const struct dual *dual, fine_t guess, int *found) TW_NODISCARD;

/* The same from beginning to end. */
enum tw_status guess_try(struct search *search, const struct dual *dual, fine_t guess, int *found) TW_NODISCARD;

/* The next guess at or above that is a whole unit of the caller's weights. */
fine_t guess_round_up(const struct instance *instance, fine_t fine);

#endif
