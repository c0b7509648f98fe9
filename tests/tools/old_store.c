/* Makes a store of an older version: `old_store FILE.sql PATH` runs the statements of a dump on a new database. */
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>

static char *read_file(const char *path)
{
	size_t size = 0, room = 1 << 20;
	FILE *file = fopen(path, "rb");
	char *text = file ? calloc(1, room) : NULL;
	if (text)
		size = fread(text, 1, room - 1, file);
	if (file)
		fclose(file);
	if (text && size < room - 1)
		return text;
	free(text);
	return NULL;
}

int main(int argc, char **argv)
{
	sqlite3 *db = NULL;
	char *sql = argc == 3 ? read_file(argv[1]) : NULL;
	int code = sql ? sqlite3_open(argv[2], &db) : SQLITE_CANTOPEN;
	if (code == SQLITE_OK)
		code = sqlite3_exec(db, sql, NULL, NULL, NULL);
	if (code != SQLITE_OK)
		fprintf(stderr, "old_store: %s\n", db ? sqlite3_errmsg(db) : "usage: old_store FILE.sql PATH");
	if (sqlite3_close(db) != SQLITE_OK)
		code = SQLITE_ERROR;
	free(sql);
	return code != SQLITE_OK;
}
