/* What a client shows of an API key: a text that is made once, told once, and kept only as a hash.
 *
 *     twk_ 52 digits 7 digits        Crockford's base 32: 256 random bits, and the checksum of all before it
 *
 * so that people and scanners know one when they see it, and one that was cut or mistyped is told from one that was
 * never given out. The hash is BLAKE2b-256 and nothing slower: a slow hash makes guessable passwords expensive to
 * guess, and nobody guesses 256 random bits; here it would only make each request expensive. */
#ifndef STORAGE_SECRET_H
#define STORAGE_SECRET_H

#include <stdbool.h>
#include <stdint.h>

enum { SECRET_SIZE = 64, SECRET_HASH_SIZE = 32 };

void secret_make(char text[SECRET_SIZE]);

/* Of any text: keys of earlier releases have another form. */
void secret_hash(const char *text, uint8_t hash[SECRET_HASH_SIZE]);

/* Whether it looks like a key of ours whose checksum is wrong. */
bool secret_is_damaged(const char *text);

#endif
