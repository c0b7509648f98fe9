/* The file of API keys, which a service can have beside those in its store. A line for each key:
 *
 *     NAME HASH      HASH: BLAKE2b-256 of the key, 64 hexadecimal digits
 *
 * so that reading the file gives nobody a key. Empty lines and lines that begin with # are skipped. Its keys are those
 * of the operator: of the tenant "default", with every scope, without limits and for ever. */
#ifndef API_KEY_FILE_H
#define API_KEY_FILE_H

#include "storage/access.h"

/* Reads the file; `*keys` is heap memory, to be freed. Their tenant is 0: who has it is known by the store. Their
 * client numbers are below 0, and a hash of their names, so that they are the same on every daemon.
 *
 * TW_ERROR_IO when it cannot be read; TW_ERROR_INPUT "key-file" with the line, also when it holds none; "key-file-open"
 * when everybody on the machine may read or write it. */
enum tw_status key_file_read(const char *path, struct access_key **keys, size_t *count,
			     struct tw_error *error) TW_NODISCARD;

#endif
