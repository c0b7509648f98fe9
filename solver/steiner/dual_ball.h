/* Balls: growing them, taking them out, putting them back. For the dual's own files. */
#ifndef SOLVER_STEINER_DUAL_BALL_H
#define SOLVER_STEINER_DUAL_BALL_H

#include "solver/steiner/dual.h"

/* Grows a ball of at most `limit` around the terminal and takes its shares from the arcs. Returns the radius; 0 leaves
 * no ball. There must be room. */
uint32_t dual_grow(struct dual *dual, struct search *search, uint32_t terminal, uint32_t limit);

/* Gives the shares back to the arcs; the ball stays remembered. And the reverse. */
void dual_take_out(struct dual *dual, struct search *search, struct dual_ball *ball);
void dual_put_back(struct dual *dual, struct search *search, struct dual_ball *ball);

/* Room for one more ball: forgets those without a terminal, which renumbers the others in their order. False without
 * memory. */
int dual_make_room(struct dual *dual);

#endif
