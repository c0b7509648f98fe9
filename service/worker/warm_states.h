/* The warm states of a worker's last drags (solver/steiner/warm/warm.h), by their jobs' affinity: a field and a word
 * that the caller calls its session. They only save time; a worker that has none computes the same. */
#ifndef SERVICE_WORKER_WARM_STATES_H
#define SERVICE_WORKER_WARM_STATES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct steiner_warm;
struct warm_states;

enum { WARM_STATES_MOST = 4 };

/* `budget`: bytes that all may hold, 0 for no limit. NULL when out of memory. */
struct warm_states *warm_states_new(size_t budget);
void warm_states_free(struct warm_states *states); /* NULL is allowed */

/* The state of this affinity, which is empty at first: the one that was used longest ago makes room. It is borrowed
 * until the next call. `is_first` (may be NULL): it was not asked for before. NULL when out of memory. */
struct steiner_warm *warm_states_get(struct warm_states *states, int64_t affinity, bool *is_first);

/* To be called after a state was prepared: drops others, least recently used first, while all together hold more than
 * the budget. */
void warm_states_settle(struct warm_states *states);

#endif
