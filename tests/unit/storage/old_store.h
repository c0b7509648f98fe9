/* The store of 0.1.0 that tests/fixtures keeps, put into a file. Include tests/unit/storage/fixture.h first. */
#ifndef TESTS_UNIT_STORAGE_OLD_STORE_H
#define TESTS_UNIT_STORAGE_OLD_STORE_H

static inline char *old_store_sql(void)
{
	FILE *file = fopen("tests/fixtures/store-0.1.0.sql", "rb");
	assert_non_null(file);
	assert_int_equal(fseek(file, 0, SEEK_END), 0);
	size_t size = (size_t)ftell(file);
	rewind(file);
	char *text = calloc(1, size + 1);
	assert_non_null(text);
	assert_int_equal(fread(text, 1, size, file), size);
	fclose(file);
	return text;
}

static inline void old_store_write(const char *path)
{
	sqlite3 *db = NULL;
	char *sql = old_store_sql();
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_close(db), SQLITE_OK);
	free(sql);
}

#endif
