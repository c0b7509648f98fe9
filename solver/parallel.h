/* Loops shared by threads. For work whose parts do not depend on one another: which thread takes which part is up to
 * the scheduler, so nothing may depend on it but speed. */
#ifndef SOLVER_PARALLEL_H
#define SOLVER_PARALLEL_H

#include <stdint.h>

enum { PARALLEL_THREADS = 64 }; /* at most */

/* Does the items first…end-1; `thread` is below the number of threads and never used by two at once. */
typedef void parallel_work(void *context, unsigned thread, uint32_t first, uint32_t end);

/* Calls `work` for 0…count-1 in parts of `grain` items, on up to `threads` threads, the caller's among them. Where a
 * thread cannot be had, the others do its share. */
void parallel_for(unsigned threads, uint32_t count, uint32_t grain, parallel_work *work, void *context);

/* Threads that stay between loops, for many short ones: starting a thread takes 20 to 50 us, a loop of a team 1. NULL,
 * which the other functions take for the caller alone, where `threads` is 1 or there is no memory. A team works for one
 * caller. */
struct parallel_team;
struct parallel_team *parallel_team_new(unsigned threads);
void parallel_team_for(struct parallel_team *team, uint32_t count, uint32_t grain, parallel_work *work, void *context);
void parallel_team_free(struct parallel_team *team);

#endif
