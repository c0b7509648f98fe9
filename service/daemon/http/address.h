/* How many connections each client address has. An IPv6 client counts by its /64, of which it has every address. Any
 * thread may call. */
#ifndef SERVICE_DAEMON_HTTP_ADDRESS_H
#define SERVICE_DAEMON_HTTP_ADDRESS_H

#include "service/daemon/http/connection.h"

#include <stdint.h>
#include <sys/socket.h>

struct address_table;

struct address_table *address_table_new(void); /* NULL when out of memory */
void address_table_free(struct address_table *table);

/* The key of an address, and the address as text. */
uint64_t address_key(const struct sockaddr_storage *address, char text[CONNECTION_PEER_SIZE]);

/* One more, one less. The former returns how many there are now, this one included. */
unsigned address_add(struct address_table *table, uint64_t key);
void address_remove(struct address_table *table, uint64_t key);

#endif
