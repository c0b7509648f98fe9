/* API keys: who may use a service that listens beyond this machine. The file holds a line for each key,
 *
 *     NAME HASH      HASH: BLAKE2b-256 of the key, 64 hexadecimal digits
 *
 * so that reading the file gives nobody a key. Empty lines and lines that begin with # are skipped. */
#ifndef API_KEY_H
#define API_KEY_H

#include "tightwire.h"

#include <stdbool.h>

struct key_list;

/* Reads the file. TW_ERROR_IO when it cannot be read, TW_ERROR_INPUT "key-file" with the line, also when it holds none.
 */
enum tw_status key_list_read(struct key_list **keys, const char *path, struct tw_error *error) TW_NODISCARD;
void key_list_free(struct key_list *keys); /* NULL is allowed */

/* Whether the value of Authorization, "Bearer KEY", is one of the keys. Takes the same time for each. NULL: no. */
bool key_list_allows(const struct key_list *keys, const char *authorization);

/* Makes a random key and the line that the key file wants for it. `name` has no blanks. */
#define KEY_TEXT_SIZE 48
#define KEY_HASH_SIZE 32
void key_make(char key[KEY_TEXT_SIZE], char hash[2 * KEY_HASH_SIZE + 1]);

#endif
