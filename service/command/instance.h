/* A Steiner instance from a file, for the commands that take one. */
#ifndef SERVICE_COMMAND_INSTANCE_H
#define SERVICE_COMMAND_INSTANCE_H

#include "solver/arena.h"
#include "solver/graph/steiner_file.h"

/* Files of the Steiner commands are not larger. */
#define INSTANCE_BYTES_MAX ((size_t)2 << 30)

/* Reads a PACE or SteinLib file, "-" for standard input. The error's place begins with the path. */
enum tw_status instance_read(const char *path, struct arena *arena, struct steiner_file *file,
			     struct tw_error *error) TW_NODISCARD;

#endif
