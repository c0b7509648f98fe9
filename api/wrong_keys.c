#include "api/wrong_keys.h"

#include <pthread.h>
#include <sodium.h>
#include <stdlib.h>

enum {
	SETS = 1024, /* of WAYS addresses each: 96 KiB */
	WAYS = 4,
	FORGIVEN_MS = 10000, /* for the score to go down by one */
	FREE = 5,            /* answered at once */
	MANY = 20,           /* 429 from here on */
	SCORE_MAX = 30,      /* after five minutes all is forgotten */
	PAUSE_STEP_MS = 200,
	PAUSE_MAX_MS = 2000,
};

struct entry {
	uint64_t address;
	int64_t clear_ms; /* when its score will be 0 */
};

struct wrong_keys {
	pthread_mutex_t lock;
	uint8_t seed[crypto_shorthash_KEYBYTES];
	uint64_t count;
	struct entry sets[SETS][WAYS];
};

struct wrong_keys *wrong_keys_new(void)
{
	struct wrong_keys *wrong = calloc(1, sizeof *wrong);
	if (!wrong)
		return NULL;
	pthread_mutex_init(&wrong->lock, NULL);
	randombytes_buf(wrong->seed, sizeof wrong->seed);
	return wrong;
}

void wrong_keys_free(struct wrong_keys *wrong)
{
	if (!wrong)
		return;
	pthread_mutex_destroy(&wrong->lock);
	free(wrong);
}

/* The address's entry; where it has none, that of its set which is the nearest to forgiveness. */
static struct entry *find(struct wrong_keys *wrong, uint64_t address)
{
	uint64_t hash = 0;
	crypto_shorthash((uint8_t *)&hash, (const uint8_t *)&address, sizeof address, wrong->seed);
	struct entry *set = wrong->sets[hash % SETS], *lowest = set;
	for (unsigned i = 0; i < WAYS; i++) {
		if (set[i].address == address)
			return &set[i];
		if (set[i].clear_ms < lowest->clear_ms)
			lowest = &set[i];
	}
	*lowest = (struct entry){.address = address};
	return lowest;
}

static unsigned raise_score(struct entry *entry, int64_t now_ms)
{
	if (entry->clear_ms < now_ms)
		entry->clear_ms = now_ms;
	entry->clear_ms += FORGIVEN_MS;
	if (entry->clear_ms > now_ms + (int64_t)SCORE_MAX * FORGIVEN_MS)
		entry->clear_ms = now_ms + (int64_t)SCORE_MAX * FORGIVEN_MS;
	return (unsigned)((entry->clear_ms - now_ms + FORGIVEN_MS - 1) / FORGIVEN_MS);
}

static struct wrong_key_verdict judge(unsigned score)
{
	struct wrong_key_verdict verdict = {.retry_s = 1};
	if (score <= FREE)
		return verdict;
	verdict.pause_ms = (score - FREE) * PAUSE_STEP_MS;
	if (verdict.pause_ms > PAUSE_MAX_MS)
		verdict.pause_ms = PAUSE_MAX_MS;
	verdict.too_many = score > MANY;
	verdict.retry_s = verdict.too_many ? (score - MANY + 1) * FORGIVEN_MS / 1000 : 1 + verdict.pause_ms / 1000;
	return verdict;
}

struct wrong_key_verdict wrong_keys_add(struct wrong_keys *wrong, uint64_t address, int64_t now_ms)
{
	pthread_mutex_lock(&wrong->lock);
	wrong->count++;
	unsigned score = raise_score(find(wrong, address), now_ms);
	pthread_mutex_unlock(&wrong->lock);
	return judge(score);
}

uint64_t wrong_keys_count(struct wrong_keys *wrong)
{
	pthread_mutex_lock(&wrong->lock);
	uint64_t count = wrong->count;
	pthread_mutex_unlock(&wrong->lock);
	return count;
}
