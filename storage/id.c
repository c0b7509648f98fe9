/* Ids in base 32 (Crockford's alphabet, which has no letters that are mistaken for digits). */
#include "storage/id.h"

#include <assert.h>
#include <sodium.h>
#include <string.h>

enum { DIGITS = 26 }; /* of 5 bits: 130, the last two zero */

void id_from_bytes(char id[STORE_ID_SIZE], const char *word, const uint8_t bytes[ID_BYTES])
{
	static const char alphabet[] = "0123456789abcdefghjkmnpqrstvwxyz";
	size_t used = strlen(word);
	assert(used + 1 + DIGITS < STORE_ID_SIZE);
	memcpy(id, word, used);
	id[used++] = '_';
	for (unsigned digit = 0; digit < DIGITS; digit++) {
		unsigned bit = 5 * digit;
		unsigned pair = (unsigned)bytes[bit / 8] << 8;
		if (bit / 8 + 1 < ID_BYTES)
			pair |= bytes[bit / 8 + 1];
		id[used++] = alphabet[pair >> (11 - bit % 8) & 31];
	}
	id[used] = '\0';
}

void id_random(char id[STORE_ID_SIZE], const char *word)
{
	uint8_t bytes[ID_BYTES];
	randombytes_buf(bytes, sizeof bytes);
	id_from_bytes(id, word, bytes);
}
