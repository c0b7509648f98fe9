/* A hash table of open addressing by the key's number, which doubles; who has not asked for a minute leaves it when the
 * uses are told, and then his buckets would be full again anyway. */
#include "api/meter.h"

#include <pthread.h>
#include <stdlib.h>

enum { SLOTS_FIRST = 64, FORGET_MS = 60000 };

/* A limit of N requests in a period of P ms: a request costs P, N come in each ms, N·P fit. So nothing is rounded. */
struct bucket {
	int64_t level;
	int64_t filled_ms;
};
enum { SECOND_MS = 1000, MINUTE_MS = 60000 };

struct slot {
	int64_t client; /* 0: free */
	int64_t requests;
	int64_t last_ms; /* of the even clock */
	struct bucket second, minute;
};

struct meter {
	pthread_mutex_t lock;
	struct slot *slots; /* owned: [slot_count], a power of two */
	size_t slot_count, used;
};

struct meter *meter_new(void)
{
	struct meter *meter = calloc(1, sizeof *meter);
	if (!meter)
		return NULL;
	pthread_mutex_init(&meter->lock, NULL);
	meter->slot_count = SLOTS_FIRST;
	meter->slots = calloc(SLOTS_FIRST, sizeof *meter->slots);
	if (meter->slots)
		return meter;
	meter_free(meter);
	return NULL;
}

void meter_free(struct meter *meter)
{
	if (!meter)
		return;
	pthread_mutex_destroy(&meter->lock);
	free(meter->slots);
	free(meter);
}

/* --- the table -------------------------------------------------------------------------------------------------- */

static struct slot *find(struct slot *slots, size_t slot_count, int64_t client)
{
	uint64_t mixed = (uint64_t)client * UINT64_C(0x9e3779b97f4a7c15);
	size_t i = (size_t)(mixed >> 32) & (slot_count - 1);
	while (slots[i].client && slots[i].client != client)
		i = (i + 1) & (slot_count - 1);
	return &slots[i];
}

/* Into a table of `slot_count`, without those that have not asked since `since_ms`. */
static bool rebuild(struct meter *meter, size_t slot_count, int64_t since_ms)
{
	struct slot *slots = calloc(slot_count, sizeof *slots);
	if (!slots)
		return false;
	meter->used = 0;
	for (size_t i = 0; i < meter->slot_count; i++) {
		const struct slot *slot = &meter->slots[i];
		if (!slot->client || (slot->last_ms < since_ms && !slot->requests))
			continue;
		*find(slots, slot_count, slot->client) = *slot;
		meter->used++;
	}
	free(meter->slots);
	meter->slots = slots;
	meter->slot_count = slot_count;
	return true;
}

static void fill_up(struct bucket *bucket, int64_t limit, int64_t period_ms, int64_t now_ms)
{
	int64_t passed_ms = now_ms - bucket->filled_ms;
	bucket->filled_ms = now_ms;
	if (passed_ms >= period_ms)
		bucket->level = limit * period_ms;
	else if (passed_ms > 0)
		bucket->level += limit * passed_ms;
	if (bucket->level > limit * period_ms)
		bucket->level = limit * period_ms;
}

/* NULL when out of memory. */
static struct slot *slot_of(struct meter *meter, const struct access_key *key, int64_t now_ms)
{
	if (2 * (meter->used + 1) > meter->slot_count && !rebuild(meter, 2 * meter->slot_count, 0))
		return NULL;
	struct slot *slot = find(meter->slots, meter->slot_count, key->owner.client);
	if (!slot->client) {
		meter->used++;
		slot->client = key->owner.client;
		slot->second = (struct bucket){SECOND_MS * key->limits.requests_per_s, now_ms};
		slot->minute = (struct bucket){MINUTE_MS * key->limits.requests_per_min, now_ms};
	}
	fill_up(&slot->second, key->limits.requests_per_s, SECOND_MS, now_ms);
	fill_up(&slot->minute, key->limits.requests_per_min, MINUTE_MS, now_ms);
	return slot;
}

/* --- limits ----------------------------------------------------------------------------------------------------- */

/* How long until a request fits, in seconds; 0: it does now. */
static unsigned wait_of(const struct bucket *bucket, int64_t limit, int64_t period_ms)
{
	if (!limit || bucket->level >= period_ms)
		return 0;
	int64_t wait_ms = (period_ms - bucket->level + limit - 1) / limit;
	return (unsigned)((wait_ms + 999) / 1000);
}

static void pay(struct bucket *bucket, int64_t limit, int64_t period_ms)
{
	if (limit)
		bucket->level -= period_ms;
}

static enum tw_status take(struct slot *slot, const struct key_limits *limits, int64_t now_ms, unsigned *retry_s,
			   struct tw_error *error)
{
	unsigned of_second = wait_of(&slot->second, limits->requests_per_s, SECOND_MS);
	unsigned of_minute = wait_of(&slot->minute, limits->requests_per_min, MINUTE_MS);
	slot->last_ms = now_ms;
	slot->requests++;
	*retry_s = of_second > of_minute ? of_second : of_minute;
	if (of_minute)
		return tw_fail(error, TW_ERROR_LIMIT, "limit-requests-per-minute", NULL,
			       "your key may ask %lld times a minute; wait", (long long)limits->requests_per_min);
	if (of_second)
		return tw_fail(error, TW_ERROR_LIMIT, "limit-requests-per-second", NULL,
			       "your key may ask %lld times a second; wait", (long long)limits->requests_per_s);
	pay(&slot->second, limits->requests_per_s, SECOND_MS);
	pay(&slot->minute, limits->requests_per_min, MINUTE_MS);
	return TW_OK;
}

enum tw_status meter_take(struct meter *meter, const struct access_key *key, int64_t now_ms, unsigned *retry_s,
			  struct tw_error *error)
{
	*retry_s = 0;
	if (key->owner.client <= 0)
		return TW_OK;
	pthread_mutex_lock(&meter->lock);
	struct slot *slot = slot_of(meter, key, now_ms);
	enum tw_status status = slot ? take(slot, &key->limits, now_ms, retry_s, error) : tw_fail_memory(error);
	pthread_mutex_unlock(&meter->lock);
	return status;
}

/* --- telling ---------------------------------------------------------------------------------------------------- */

static size_t collect(struct meter *meter, int64_t now_ms, int64_t wall_ms, struct access_use *uses)
{
	size_t count = 0;
	for (size_t i = 0; i < meter->slot_count; i++) {
		struct slot *slot = &meter->slots[i];
		if (slot->requests)
			uses[count++] =
				(struct access_use){slot->client, slot->requests, wall_ms - (now_ms - slot->last_ms)};
		slot->requests = 0;
	}
	return count;
}

enum tw_status meter_drain(struct meter *meter, int64_t now_ms, int64_t wall_ms, struct access_use **uses,
			   size_t *count, struct tw_error *error)
{
	*count = 0;
	pthread_mutex_lock(&meter->lock);
	*uses = calloc(meter->used + 1, sizeof **uses);
	if (*uses) {
		*count = collect(meter, now_ms, wall_ms, *uses);
		/* Where memory is short the old table goes on. */
		(void)rebuild(meter, meter->slot_count, now_ms - FORGET_MS);
	}
	pthread_mutex_unlock(&meter->lock);
	return *uses ? TW_OK : tw_fail_memory(error);
}
