#include "storage/id.h"

#include "storage/base32.h"

#include <assert.h>
#include <sodium.h>
#include <string.h>

enum { DIGITS = 26 }; /* of 5 bits: 130, the last two zero */

void id_from_bytes(char id[STORE_ID_SIZE], const char *word, const uint8_t bytes[ID_BYTES])
{
	size_t used = strlen(word);
	assert(used + 1 + DIGITS < STORE_ID_SIZE);
	memcpy(id, word, used);
	id[used++] = '_';
	base32_print(id + used, DIGITS, bytes, ID_BYTES);
	id[used + DIGITS] = '\0';
}

void id_random(char id[STORE_ID_SIZE], const char *word)
{
	uint8_t bytes[ID_BYTES];
	randombytes_buf(bytes, sizeof bytes);
	id_from_bytes(id, word, bytes);
}
