#include "api/key_file.h"

#include <errno.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct list {
	struct access_key *keys;
	size_t count, room;
};

static int64_t number_of(const char *name)
{
	uint8_t hash[16];
	uint64_t number = 0;
	crypto_generichash(hash, sizeof hash, (const uint8_t *)name, strlen(name), NULL, 0);
	for (unsigned i = 0; i < 8; i++)
		number = number << 8 | hash[i];
	return -1 - (int64_t)(number >> 1);
}

static enum tw_status add_key(struct list *list, const char *name, const uint8_t hash[SECRET_HASH_SIZE],
			      struct tw_error *error)
{
	if (list->count == list->room) {
		size_t room = list->room ? 2 * list->room : 16;
		void *grown = realloc(list->keys, room * sizeof *list->keys);
		if (!grown)
			return tw_fail_memory(error);
		list->keys = grown;
		list->room = room;
	}
	struct access_key *key = &list->keys[list->count++];
	*key = (struct access_key){.owner = {0, number_of(name)}, .scopes = KEY_SCOPES_ALL};
	memcpy(key->hash, hash, SECRET_HASH_SIZE);
	snprintf(key->tenant, sizeof key->tenant, "default");
	snprintf(key->name, sizeof key->name, "%s", name);
	return TW_OK;
}

static enum tw_status add_line(struct list *list, const char *path, int number, char *line, struct tw_error *error)
{
	char where[sizeof error->where], *rest = NULL;
	snprintf(where, sizeof where, "%.100s, line %d", path, number);
	const char *name = strtok_r(line, " \t\r\n", &rest);
	const char *hash = strtok_r(NULL, " \t\r\n", &rest);
	if (!name || name[0] == '#')
		return TW_OK;
	uint8_t bytes[SECRET_HASH_SIZE];
	size_t size = 0;
	if (!hash || sodium_hex2bin(bytes, sizeof bytes, hash, strlen(hash), NULL, &size, NULL) != 0 ||
	    size != sizeof bytes || strlen(hash) != 2 * sizeof bytes)
		return tw_fail(error, TW_ERROR_INPUT, "key-file", where, "the key file wants NAME HASH on this line");
	return add_key(list, name, bytes, error);
}

/* Hashes give nobody a key, but who can write here lets himself in, and names are not everybody's business either. */
static enum tw_status check_mode(FILE *file, const char *path, struct tw_error *error)
{
	struct stat about;
	if (fstat(fileno(file), &about) != 0)
		return tw_fail(error, TW_ERROR_IO, "key-file", path, "the key file cannot be read: %s",
			       strerror(errno));
	if (S_ISREG(about.st_mode) && about.st_mode & S_IRWXO)
		return tw_fail(error, TW_ERROR_INPUT, "key-file-open", path,
			       "everybody on this machine may use the key file; run: chmod o= %.200s", path);
	return TW_OK;
}

enum tw_status key_file_read(const char *path, struct access_key **keys, size_t *count, struct tw_error *error)
{
	struct list list = {0};
	FILE *file = fopen(path, "re");
	if (!file)
		return tw_fail(error, TW_ERROR_IO, "key-file", path, "the key file cannot be read: %s",
			       strerror(errno));
	char line[512];
	enum tw_status status = check_mode(file, path, error);
	for (int number = 1; status == TW_OK && fgets(line, sizeof line, file); number++)
		status = add_line(&list, path, number, line, error);
	fclose(file);
	if (status == TW_OK && !list.count)
		status = tw_fail(error, TW_ERROR_INPUT, "key-file", path, "the key file holds no key");
	if (status != TW_OK)
		free(list.keys);
	*keys = status == TW_OK ? list.keys : NULL;
	*count = status == TW_OK ? list.count : 0;
	return status;
}
