/* The texts of migrations that have files of their own. Known only to schema.c. */
#ifndef STORAGE_SCHEMA_PARTS_H
#define STORAGE_SCHEMA_PARTS_H

/* Of migration 5, in this order. */
extern const char schema_tenants[];    /* schema_tenant.c */
extern const char schema_queue[];      /* schema_queue.c */
extern const char schema_queue_jobs[]; /* the same */
extern const char schema_usage[];      /* schema_tenant.c: when the table of jobs is as it will be */

#endif
