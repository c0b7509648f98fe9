/* hold_store URL: takes the store's write lock, prints "held", and gives it back when its input ends. */
#include "storage/sql.h"
#include "storage/store.h"

#include <stdio.h>

int main(int argc, char **argv)
{
	struct store *store = NULL;
	struct tw_error error = {0};
	if (argc != 2 || store_open(&store, argv[1], &error) != TW_OK ||
	    transaction_begin(store, false, &error) != TW_OK) {
		fprintf(stderr, "hold_store: %s\n", argc == 2 ? error.text : "name the store");
		return 1;
	}
	printf("held\n");
	fflush(stdout);
	while (getchar() != EOF)
		;
	enum tw_status status = transaction_end(store, TW_OK, &error);
	store_close(store);
	return status != TW_OK;
}
