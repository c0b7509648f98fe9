/* Numbers of rows and of changes count what all tenants do. Where a client has to be given one, as a cursor, it gets it
 * enciphered with its tenant's key (a Feistel network of four rounds of SipHash on the 64 bits): the same text for the
 * same number on every daemon, and no telling which number it is, or how far two lie apart. */
#ifndef API_VEIL_H
#define API_VEIL_H

#include "storage/access.h"

#include <stdbool.h>

enum { VEIL_TEXT_SIZE = 17 };

void veil_print(const uint8_t veil[ACCESS_VEIL_SIZE], int64_t number, char text[VEIL_TEXT_SIZE]);

/* False for what veil_print has not made, but for one in two thousand: those are numbers like any other. */
bool veil_parse(const uint8_t veil[ACCESS_VEIL_SIZE], const char *text, int64_t *number);

#endif
