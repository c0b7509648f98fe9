#include "api/key.h"

#include <errno.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct key_list {
	size_t count;
	uint8_t (*hashes)[KEY_HASH_SIZE]; /* owned */
};

static enum tw_status add_line(struct key_list *keys, const char *path, int number, char *line, struct tw_error *error)
{
	char where[sizeof error->where], *rest = NULL;
	snprintf(where, sizeof where, "%.100s, line %d", path, number);
	const char *name = strtok_r(line, " \t\r\n", &rest);
	const char *hash = strtok_r(NULL, " \t\r\n", &rest);
	if (!name || name[0] == '#')
		return TW_OK;
	uint8_t bytes[KEY_HASH_SIZE];
	size_t size = 0;
	if (!hash || sodium_hex2bin(bytes, sizeof bytes, hash, strlen(hash), NULL, &size, NULL) != 0 ||
	    size != sizeof bytes || strlen(hash) != 2 * sizeof bytes)
		return tw_fail(error, TW_ERROR_INPUT, "key-file", where, "the key file wants NAME HASH on this line");
	void *grown = realloc(keys->hashes, (keys->count + 1) * sizeof bytes);
	if (!grown)
		return tw_fail_memory(error);
	keys->hashes = grown;
	memcpy(keys->hashes[keys->count++], bytes, sizeof bytes);
	return TW_OK;
}

enum tw_status key_list_read(struct key_list **keys, const char *path, struct tw_error *error)
{
	*keys = NULL;
	FILE *file = fopen(path, "re");
	if (!file)
		return tw_fail(error, TW_ERROR_IO, "key-file", path, "the key file cannot be read: %s",
			       strerror(errno));
	struct key_list *made = calloc(1, sizeof *made);
	enum tw_status status = made ? TW_OK : tw_fail_memory(error);
	char line[512];
	for (int number = 1; status == TW_OK && fgets(line, sizeof line, file); number++)
		status = add_line(made, path, number, line, error);
	fclose(file);
	if (status == TW_OK && !made->count)
		status = tw_fail(error, TW_ERROR_INPUT, "key-file", path, "the key file holds no key");
	if (status != TW_OK)
		key_list_free(made);
	else
		*keys = made;
	return status;
}

void key_list_free(struct key_list *keys)
{
	if (keys)
		free(keys->hashes);
	free(keys);
}

static void hash_key(const char *key, uint8_t hash[KEY_HASH_SIZE])
{
	crypto_generichash(hash, KEY_HASH_SIZE, (const uint8_t *)key, strlen(key), NULL, 0);
}

bool key_list_allows(const struct key_list *keys, const char *authorization)
{
	if (!authorization || strncasecmp(authorization, "Bearer ", 7) != 0)
		return false;
	uint8_t hash[KEY_HASH_SIZE];
	hash_key(authorization + 7 + strspn(authorization + 7, " "), hash);
	bool allowed = false;
	for (size_t i = 0; i < keys->count; i++)
		allowed |= sodium_memcmp(keys->hashes[i], hash, sizeof hash) == 0;
	return allowed;
}

void key_make(char key[KEY_TEXT_SIZE], char hash[2 * KEY_HASH_SIZE + 1])
{
	uint8_t random[32], bytes[KEY_HASH_SIZE];
	randombytes_buf(random, sizeof random);
	sodium_bin2base64(key, KEY_TEXT_SIZE, random, sizeof random, sodium_base64_VARIANT_URLSAFE_NO_PADDING);
	hash_key(key, bytes);
	sodium_bin2hex(hash, 2 * KEY_HASH_SIZE + 1, bytes, sizeof bytes);
}
