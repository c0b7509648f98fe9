/* What a person sees who waits: one line on stderr that is written over, and only where stderr is a terminal. For the
 * commands; one thread. */
#ifndef SERVICE_COMMAND_PROGRESS_H
#define SERVICE_COMMAND_PROGRESS_H

#include "tightwire.h"

/* Shows the line; what comes faster than the eye is left out. */
TW_PRINTF(1, 2) void progress_show(const char *format, ...);

/* Wipes it, before anything else is printed. */
void progress_clear(void);

#endif
