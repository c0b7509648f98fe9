/* Ids: a word, "_" and 128 bits in base 32 (the lower-case letters and digits without i, l, o, u). Internal to this
 * folder. */
#ifndef STORAGE_ID_H
#define STORAGE_ID_H

#include "storage/store.h"

enum { ID_BYTES = 16 };

void id_from_bytes(char id[STORE_ID_SIZE], const char *word, const uint8_t bytes[ID_BYTES]);
void id_random(char id[STORE_ID_SIZE], const char *word);

#endif
