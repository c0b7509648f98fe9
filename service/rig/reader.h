/* The rig process: keeps the rig's state in the store current and makes the recordings that are queued.
 *
 *   acquisition box ──Modbus──► scanner thread ──ring──► rig_run ──rows──► store ◄── api
 *
 * A recording is a job like any other: claimed with a lease, written with its fence. When the process dies in the
 * middle, the next one goes on with it at once, because it knows that it is alone (storage/role.h), and what follows is
 * appended to what was there: the time between is a gap. Where no other comes, the daemon ends it (ending.h). */
#ifndef SERVICE_RIG_READER_H
#define SERVICE_RIG_READER_H

#include "service/rig/scanner.h"
#include "storage/store.h"

#include <signal.h>

#define RIG_WORKER "rig" /* who has the leases of recordings */

/* Runs until *stop is set; an unfinished recording goes back to the queue. `device_url` is for display. */
enum tw_status rig_run(struct store *store, struct rig_scanner *scanner, const char *device_url,
		       const volatile sig_atomic_t *stop, struct tw_error *error) TW_NODISCARD;

#endif
