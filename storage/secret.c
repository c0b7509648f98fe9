#include "storage/secret.h"

#include "storage/base32.h"

#include <assert.h>
#include <sodium.h>
#include <string.h>

static const char prefix[] = "twk_";

enum {
	PREFIX = sizeof prefix - 1,
	DIGITS = 52, /* of 5 bits: 260, the last four zero */
	CHECKED = PREFIX + DIGITS,
	CHECK_DIGITS = 7
};
static_assert(CHECKED + CHECK_DIGITS + 1 == SECRET_SIZE, "the form above");

static void print_checksum(const char *text, char digits[CHECK_DIGITS])
{
	uint8_t hash[16];
	crypto_generichash(hash, sizeof hash, (const uint8_t *)text, CHECKED, NULL, 0);
	base32_print(digits, CHECK_DIGITS, hash, sizeof hash);
}

void secret_make(char text[SECRET_SIZE])
{
	uint8_t random[32];
	randombytes_buf(random, sizeof random);
	memcpy(text, prefix, PREFIX);
	base32_print(text + PREFIX, DIGITS, random, sizeof random);
	print_checksum(text, text + CHECKED);
	text[SECRET_SIZE - 1] = '\0';
	sodium_memzero(random, sizeof random);
}

void secret_hash(const char *text, uint8_t hash[SECRET_HASH_SIZE])
{
	crypto_generichash(hash, SECRET_HASH_SIZE, (const uint8_t *)text, strlen(text), NULL, 0);
}

bool secret_is_damaged(const char *text)
{
	char digits[CHECK_DIGITS];
	if (strncmp(text, prefix, PREFIX) != 0)
		return false;
	if (strlen(text) != SECRET_SIZE - 1)
		return true;
	print_checksum(text, digits);
	return memcmp(digits, text + CHECKED, CHECK_DIGITS) != 0;
}
