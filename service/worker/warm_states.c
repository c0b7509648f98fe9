#include "service/worker/warm_states.h"

#include "solver/steiner/warm/warm.h"

#include <stdlib.h>
#include <string.h>

/* Most recently used first. */
struct warm_states {
	size_t budget;
	size_t count;
	struct entry {
		int64_t affinity;
		struct steiner_warm *warm; /* owned */
	} entry[WARM_STATES_MOST];
};

struct warm_states *warm_states_new(size_t budget)
{
	struct warm_states *states = calloc(1, sizeof *states);
	if (states)
		states->budget = budget;
	return states;
}

void warm_states_free(struct warm_states *states)
{
	for (size_t i = 0; states && i < states->count; i++)
		steiner_warm_free(states->entry[i].warm);
	free(states);
}

static void drop_last(struct warm_states *states)
{
	steiner_warm_free(states->entry[--states->count].warm);
}

/* No state may take more than all together. */
static struct steiner_warm *add(struct warm_states *states, int64_t affinity)
{
	struct steiner_warm *warm = steiner_warm_new(states->budget);
	if (!warm)
		return NULL;
	if (states->count == WARM_STATES_MOST)
		drop_last(states);
	states->entry[states->count++] = (struct entry){affinity, warm};
	return warm;
}

struct steiner_warm *warm_states_get(struct warm_states *states, int64_t affinity, bool *is_first)
{
	size_t i = 0;
	while (i < states->count && states->entry[i].affinity != affinity)
		i++;
	if (is_first)
		*is_first = i == states->count;
	if (i == states->count) {
		if (!add(states, affinity))
			return NULL;
		i = states->count - 1;
	}
	const struct entry used = states->entry[i];
	memmove(states->entry + 1, states->entry, i * sizeof used);
	states->entry[0] = used;
	return used.warm;
}

static size_t bytes_held(const struct warm_states *states)
{
	size_t bytes = 0;
	for (size_t i = 0; i < states->count; i++)
		bytes += steiner_warm_bytes(states->entry[i].warm);
	return bytes;
}

void warm_states_settle(struct warm_states *states)
{
	while (states->budget && states->count > 1 && bytes_held(states) > states->budget)
		drop_last(states);
}
