/* Base 32 in Crockford's alphabet, in lower case: it has no letters that are mistaken for digits. Internal to this
 * folder. */
#ifndef STORAGE_BASE32_H
#define STORAGE_BASE32_H

#include <stddef.h>
#include <stdint.h>

/* Writes `digits` digits of the bytes' bits, the highest bit of the first byte first, and no '\0'. Beyond the bytes the
 * bits are zero. */
void base32_print(char *text, size_t digits, const uint8_t *bytes, size_t size);

#endif
