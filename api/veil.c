#include "api/veil.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 4 };
#define NUMBER_MAX (INT64_C(1) << 53)

static uint32_t mix(const uint8_t veil[ACCESS_VEIL_SIZE], uint32_t half, unsigned round)
{
	const uint8_t bytes[5] = {(uint8_t)half, (uint8_t)(half >> 8), (uint8_t)(half >> 16), (uint8_t)(half >> 24),
				  (uint8_t)round};
	uint8_t hash[crypto_shorthash_BYTES];
	crypto_shorthash(hash, bytes, sizeof bytes, veil);
	return (uint32_t)hash[0] | (uint32_t)hash[1] << 8 | (uint32_t)hash[2] << 16 | (uint32_t)hash[3] << 24;
}

void veil_print(const uint8_t veil[ACCESS_VEIL_SIZE], int64_t number, char text[VEIL_TEXT_SIZE])
{
	uint32_t left = (uint32_t)((uint64_t)number >> 32), right = (uint32_t)number;
	for (unsigned round = 0; round < ROUNDS; round++) {
		uint32_t next = left ^ mix(veil, right, round);
		left = right;
		right = next;
	}
	snprintf(text, VEIL_TEXT_SIZE, "%08x%08x", left, right);
}

bool veil_parse(const uint8_t veil[ACCESS_VEIL_SIZE], const char *text, int64_t *number)
{
	if (strlen(text) != VEIL_TEXT_SIZE - 1 || strspn(text, "0123456789abcdef") != VEIL_TEXT_SIZE - 1)
		return false;
	uint64_t both = strtoull(text, NULL, 16);
	uint32_t left = (uint32_t)(both >> 32), right = (uint32_t)both;
	for (unsigned round = ROUNDS; round-- > 0;) {
		uint32_t before = right ^ mix(veil, left, round);
		right = left;
		left = before;
	}
	both = (uint64_t)left << 32 | right;
	*number = (int64_t)both;
	return both < NUMBER_MAX;
}
