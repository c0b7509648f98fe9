/* `tightwire key NAME`: a new API key, and the line for the key file that lets it in. */
#include "api/key.h"
#include "service/command/command.h"

#include <sodium.h>
#include <stdio.h>
#include <string.h>

int command_key(int argc, char **argv)
{
	if (argc == 2 && !strcmp(argv[1], "--help")) {
		printf("usage: tightwire key NAME >> KEY_FILE\n\n"
		       "Prints the line \"NAME HASH\" for the key file on standard output, and the key itself, which "
		       "is kept\n"
		       "nowhere, on standard error. Clients send it as Authorization: Bearer KEY.\n");
		return COMMAND_DONE;
	}
	if (argc != 2 || !argv[1][0] || argv[1][0] == '-' || argv[1][0] == '#' || strpbrk(argv[1], " \t\r\n")) {
		fprintf(stderr, "usage: tightwire key NAME (one word) >> KEY_FILE\n");
		return COMMAND_USAGE;
	}
	if (sodium_init() < 0) {
		fprintf(stderr, "tightwire key: libsodium cannot be initialised\n");
		return COMMAND_FAILED;
	}
	char key[KEY_TEXT_SIZE], hash[2 * KEY_HASH_SIZE + 1];
	key_make(key, hash);
	fprintf(stderr, "%s\n", key);
	printf("%s %s\n", argv[1], hash);
	return COMMAND_DONE;
}
