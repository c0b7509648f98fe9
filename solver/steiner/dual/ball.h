/* Balls: growing them, taking them out, putting them back. For the dual's own files. */
#ifndef SOLVER_STEINER_DUAL_BALL_H
#define SOLVER_STEINER_DUAL_BALL_H

#include "solver/steiner/dual/dual.h"

/* Why a ball grows no further. */
enum dual_stop { DUAL_AT_LIMIT, DUAL_AT_ROOT, DUAL_AT_GUIDE };

/* Grows a ball of at most `limit` around the terminal and takes its shares from the arcs; no ball is left when the
 * radius would be 0. `guided`: it stops where it would cut the guide in two. There must be room. */
enum dual_stop dual_grow(struct dual *dual, struct search *search, uint32_t terminal, uint32_t limit, int guided);

/* Gives the shares back to the arcs; the ball stays remembered. And the reverse. */
void dual_take_out(struct dual *dual, struct search *search, struct dual_ball *ball);
void dual_put_back(struct dual *dual, struct search *search, struct dual_ball *ball);

/* Room for one more ball: forgets those without a terminal, which renumbers the others in their order. False without
 * memory. */
int dual_make_room(struct dual *dual);

/* Grows the terminals of `group`, which is used up, in turns, each turn up to a common limit on a terminal's value that
 * rises by `factor_percent` from turn to turn, until all have reached the root. `guided`: as long as the guide allows
 * it. */
enum tw_status dual_ascend_group(struct dual *dual, struct search *search, uint32_t *group, uint32_t count,
				 uint64_t limit, unsigned factor_percent, int guided) TW_NODISCARD;

/* A pseudo-random number below `below`, the same on every machine. */
uint64_t dual_draw(struct dual *dual, uint64_t below);

#endif
