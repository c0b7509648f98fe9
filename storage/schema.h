/* The tables, as a list of migrations: number n takes a database from version n-1 to n (PRAGMA user_version). A
 * released migration is never changed. */
#ifndef STORAGE_SCHEMA_H
#define STORAGE_SCHEMA_H

#include "tightwire.h"

#include <sqlite3.h>

#define SCHEMA_VERSION 5
#define SCHEMA_APPLICATION_ID 0x74777265 /* "twre" */

/* Whether the database is ours, or new; of another's nothing is changed. TW_ERROR_INPUT "store-foreign". */
enum tw_status schema_check_owner(sqlite3 *db, struct tw_error *error) TW_NODISCARD;

/* Brings the database up to `target` (SCHEMA_VERSION but in tests), each migration in a transaction of its own; several
 * processes may try at once. TW_ERROR_UNSUPPORTED "store-newer". */
enum tw_status schema_migrate(sqlite3 *db, int target, struct tw_error *error) TW_NODISCARD;

#endif
