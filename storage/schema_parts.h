/* The texts of migrations that have files of their own. Known only to schema.c. */
#ifndef STORAGE_SCHEMA_PARTS_H
#define STORAGE_SCHEMA_PARTS_H

extern const char schema_tenants[]; /* schema_tenant.c */
extern const char schema_usage[];   /* the same, behind what makes the table of jobs anew */

#endif
