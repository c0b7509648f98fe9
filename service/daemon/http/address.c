/* A hash table of open addressing that doubles; a key without connections stays until the table is built anew. */
#include "service/daemon/http/address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define SLOTS_FIRST 256u

struct slot {
	uint64_t key; /* 0: free */
	unsigned count;
};

struct address_table {
	pthread_mutex_t lock;
	struct slot *slots; /* owned: [slot_count], a power of two */
	size_t slot_count, used;
};

struct address_table *address_table_new(void)
{
	struct address_table *table = calloc(1, sizeof *table);
	if (!table)
		return NULL;
	table->slots = calloc(SLOTS_FIRST, sizeof *table->slots);
	table->slot_count = SLOTS_FIRST;
	pthread_mutex_init(&table->lock, NULL);
	if (table->slots)
		return table;
	address_table_free(table);
	return NULL;
}

void address_table_free(struct address_table *table)
{
	if (!table)
		return;
	pthread_mutex_destroy(&table->lock);
	free(table->slots);
	free(table);
}

uint64_t address_key(const struct sockaddr_storage *address, char text[CONNECTION_PEER_SIZE])
{
	const struct sockaddr_in *v4 = (const struct sockaddr_in *)(const void *)address;
	const struct sockaddr_in6 *v6 = (const struct sockaddr_in6 *)(const void *)address;
	uint32_t four = 0;
	uint64_t prefix = 0;
	snprintf(text, CONNECTION_PEER_SIZE, "-");
	if (address->ss_family == AF_INET) {
		inet_ntop(AF_INET, &v4->sin_addr, text, CONNECTION_PEER_SIZE);
		return (uint64_t)v4->sin_addr.s_addr | UINT64_C(1) << 32;
	}
	if (address->ss_family != AF_INET6)
		return UINT64_C(2) << 32;
	inet_ntop(AF_INET6, &v6->sin6_addr, text, CONNECTION_PEER_SIZE);
	if (IN6_IS_ADDR_V4MAPPED(&v6->sin6_addr)) {
		memcpy(&four, v6->sin6_addr.s6_addr + 12, sizeof four);
		return (uint64_t)four | UINT64_C(1) << 32;
	}
	memcpy(&prefix, v6->sin6_addr.s6_addr, sizeof prefix);
	return prefix ? prefix : 3;
}

static struct slot *find(const struct address_table *table, uint64_t key)
{
	uint64_t mixed = key * UINT64_C(0x9e3779b97f4a7c15);
	size_t i = (size_t)(mixed >> 32) & (table->slot_count - 1);
	while (table->slots[i].key && table->slots[i].key != key)
		i = (i + 1) & (table->slot_count - 1);
	return &table->slots[i];
}

/* Keeps those that have connections, in a table that they fill by a quarter at most. Where memory is short the old one
 * goes on, as long as it has a free slot. */
static void rebuild(struct address_table *table)
{
	size_t live = 0;
	for (size_t i = 0; i < table->slot_count; i++)
		live += table->slots[i].count > 0;
	struct address_table next = {.slot_count = SLOTS_FIRST};
	while (next.slot_count < 4 * live)
		next.slot_count *= 2;
	next.slots = calloc(next.slot_count, sizeof *next.slots);
	if (!next.slots)
		return;
	for (size_t i = 0; i < table->slot_count; i++)
		if (table->slots[i].count)
			*find(&next, table->slots[i].key) = table->slots[i];
	free(table->slots);
	table->slots = next.slots;
	table->slot_count = next.slot_count;
	table->used = live;
}

unsigned address_add(struct address_table *table, uint64_t key)
{
	unsigned count = 0;
	pthread_mutex_lock(&table->lock);
	if (2 * table->used >= table->slot_count)
		rebuild(table);
	struct slot *slot = find(table, key);
	bool fits = slot->key || table->used + 1 < table->slot_count;
	if (fits) {
		table->used += slot->key == 0;
		slot->key = key;
		count = ++slot->count;
	}
	pthread_mutex_unlock(&table->lock);
	return fits ? count : UINT32_MAX;
}

void address_remove(struct address_table *table, uint64_t key)
{
	pthread_mutex_lock(&table->lock);
	struct slot *slot = find(table, key);
	if (slot->count)
		slot->count--;
	pthread_mutex_unlock(&table->lock);
}
