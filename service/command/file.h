/* Files for the commands that work without a store. Errors name the path and what the system said. */
#ifndef SERVICE_COMMAND_FILE_H
#define SERVICE_COMMAND_FILE_H

#include "solver/motion/motion.h"
#include "tightwire.h"

/* Reads a whole file ("-": standard input) of at most `limit` bytes; *bytes is the caller's to free, with a NUL behind
 * its end. TW_ERROR_IO, TW_ERROR_LIMIT, TW_ERROR_MEMORY. */
enum tw_status file_read(const char *path, size_t limit, char **bytes, size_t *size,
			 struct tw_error *error) TW_NODISCARD;

/* Puts the path before an error's place, so that one line says which file it is about. Returns `status`. */
enum tw_status file_blame(enum tw_status status, const char *path, struct tw_error *error);

/* Writes a file whole: under another name first, so that a reader finds either the old file or the new one. */
enum tw_status file_write(const char *path, const void *bytes, size_t size, struct tw_error *error) TW_NODISCARD;

/* A file as the source of a motion; *source is good until file_source_close. */
struct file_source {
	FILE *file; /* owned */
};
enum tw_status file_source_open(struct file_source *opened, struct byte_source *source, const char *path,
				struct tw_error *error) TW_NODISCARD;
void file_source_close(struct file_source *opened);

/* Makes a folder, and those above it, where they are missing. */
enum tw_status file_make_folder(const char *path, struct tw_error *error) TW_NODISCARD;

/* Before a long computation: makes the folder and checks that files can be written into it. */
enum tw_status file_prepare_folder(const char *path, struct tw_error *error) TW_NODISCARD;

/* Before a long computation: checks that file_write can make this file. */
enum tw_status file_check_writable(const char *path, struct tw_error *error) TW_NODISCARD;

#endif
