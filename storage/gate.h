/* The queue before the write lock: one process at a time, those that wait in the order in which they came. Internal to
 * this folder.
 *
 * SQLite's own lock stays what keeps writers apart; but who finds it taken sleeps and tries again, for up to 100 ms,
 * and a process that writes a lot takes it between two tries of another over and over. So everybody passes here before.
 *
 * The queue is two locks of the kernel (open file description locks on two bytes of a file beside the database): `next`
 * is held by who is the next to write, and given up once `turn` is. Who has just written and wants to write again finds
 * `next` taken and stands behind it. A process that dies lets go of both, whatever it was doing; no process id and no
 * memory is shared, so containers and reboots are no special case. Where the file system knows no such locks, or the
 * file cannot be had, the queue is not fair any more, but nothing else is lost. */
#ifndef STORAGE_GATE_H
#define STORAGE_GATE_H

#include "tightwire.h"

#include <stdbool.h>

struct gate;

/* The lock file of a database, which the gate and role.h share; the caller closes it. -1 where it cannot be had. */
enum { GATE_BYTES = 16 }; /* the first bytes are the gate's */
int gate_open_file(const char *database);

/* The lock file is `database` with "-gate" behind it, and made where it is not there. */
enum tw_status gate_open(struct gate **gate, const char *database, struct tw_error *error) TW_NODISCARD;
void gate_close(struct gate *gate); /* NULL is allowed */

/* Waits until it is this process's turn, for at most `timeout_ms`; false when that was not enough. One thread at a time
 * may enter, stay inside and leave; it need not be the same. */
bool gate_enter(struct gate *gate, int64_t timeout_ms);
void gate_leave(struct gate *gate);

#endif
