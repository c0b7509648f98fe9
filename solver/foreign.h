/* Files that are not what is read here: what they are, by their first bytes, and what to send instead. */
#ifndef SOLVER_FOREIGN_H
#define SOLVER_FOREIGN_H

#include <stddef.h>

/* "a zip archive; unpack it", "a web page", …; NULL for bytes that are none of those known. Static. */
const char *foreign_kind(const void *bytes, size_t size);

#endif
