/* Who shows wrong keys, by address, so that guessing is slow and the log stays readable, and nobody else is locked out:
 * a right key is let in whatever its address has done, because others may be behind the same proxy.
 *
 * Each wrong key adds to its address's score, which goes down by one every ten seconds. The first few are answered at
 * once; beyond that the answer takes longer and longer, with the connection held and counted (so that an address with
 * N connections guesses N times in that time), and at last it is 429. Memory is fixed: addresses share it, and the
 * lowest scores make room. Any thread may call. */
#ifndef API_WRONG_KEYS_H
#define API_WRONG_KEYS_H

#include <stdbool.h>
#include <stdint.h>

struct wrong_keys;

struct wrong_keys *wrong_keys_new(void); /* NULL when out of memory */
void wrong_keys_free(struct wrong_keys *wrong);

struct wrong_key_verdict {
	unsigned pause_ms; /* before the answer */
	unsigned retry_s;  /* what the answer recommends */
	bool too_many;     /* the answer is 429 rather than 401 */
};

/* One more of the address (any number that stands for it) at `now_ms` of an even clock. */
struct wrong_key_verdict wrong_keys_add(struct wrong_keys *wrong, uint64_t address, int64_t now_ms);

/* Of all addresses, since the start. */
uint64_t wrong_keys_count(struct wrong_keys *wrong);

#endif
