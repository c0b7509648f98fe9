/* The rig's clock: CLOCK_BOOTTIME, which goes on while the machine sleeps and which nobody can set. It says when a slot
 * is due and how long a recording is; the wall clock only labels what comes of it. It begins anew with each boot. */
#ifndef SERVICE_RIG_CLOCK_H
#define SERVICE_RIG_CLOCK_H

#include <stdint.h>

int64_t rig_clock_us(void);

/* The kernel's id of this boot; "" where it has none. */
enum { RIG_BOOT_SIZE = 40 };
void rig_clock_boot(char boot[RIG_BOOT_SIZE]);

/* What the wall clock shows now, less what the rig's clock shows: added to a time of the one it gives the other. */
int64_t rig_clock_wall_offset_us(void);

#endif
