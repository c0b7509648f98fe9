/* The log: one line an event on stderr, "TIME LEVEL EVENT key=value …", written with one write so that the lines of
 * several processes do not mix. */
#ifndef SERVICE_LOG_H
#define SERVICE_LOG_H

#include "tightwire.h"

enum log_level { LOG_LEVEL_ERROR, LOG_LEVEL_WARNING, LOG_LEVEL_INFO, LOG_LEVEL_DEBUG };

/* Lines above this level are left out; at first LOG_LEVEL_INFO. Any thread may set it at any time. */
void log_set_level(enum log_level level);

/* The name and `format` are the event's words; a value with blanks is put in quotes by the caller. Control characters
 * are replaced, so that nothing that a client sends can forge a line. */
TW_PRINTF(3, 4) void log_event(enum log_level level, const char *event, const char *format, ...);

/* The event with an error's status, place and text. */
void log_error(const char *event, const struct tw_error *error);

#endif
