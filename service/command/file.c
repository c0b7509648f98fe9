#include "service/command/file.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
	WHERE_SIZE = sizeof((struct tw_error *)0)->where,
	INSIDE_MAX = 80, /* bytes that a place within the file may take from its path */
};

/* The path, and a place within the file where there is one. Of a path that is too long the end is shown, which tells
 * more than its beginning. */
static void tell_place(const char *path, const char *inside, char where[static WHERE_SIZE])
{
	static const char cut[] = "…";
	size_t length = strlen(path), inside_length = strnlen(inside, INSIDE_MAX);
	const char *glue = inside_length ? ": " : "";
	size_t room = WHERE_SIZE - 1 - inside_length - strlen(glue);
	bool is_cut = length > room;
	if (is_cut)
		path += length - (room - strlen(cut));
	while (is_cut && (*path & 0xc0) == 0x80) /* never half a character */
		path++;
	snprintf(where, WHERE_SIZE, "%s%s%s%.*s", is_cut ? cut : "", path, glue, (int)inside_length, inside);
}

static enum tw_status fail_file(const char *path, const char *doing, struct tw_error *error)
{
	int number = errno;
	enum tw_status status = number == ENOSPC || number == EDQUOT || number == EFBIG ? TW_ERROR_FULL : TW_ERROR_IO;
	char where[WHERE_SIZE] = "";
	if (path)
		tell_place(path, "", where);
	return tw_fail(error, status, "file", where, "cannot %s: %s", doing, strerror(number));
}

enum tw_status file_blame(enum tw_status status, const char *path, struct tw_error *error)
{
	char where[WHERE_SIZE];
	if (status == TW_OK || !path)
		return status;
	tell_place(path, "", where);
	if (strcmp(error->where, where) != 0) {
		tell_place(path, error->where, where);
		memcpy(error->where, where, sizeof where);
	}
	return status;
}

/* Reads until the end or the limit; the file may be a pipe, so its size is not asked for. */
static enum tw_status read_all(FILE *file, const char *path, size_t limit, char **bytes, size_t *size,
			       struct tw_error *error)
{
	size_t capacity = 0;
	for (;;) {
		if (*size + 1 >= capacity) {
			capacity = capacity ? 2 * capacity : (size_t)1 << 16;
			char *larger = realloc(*bytes, capacity);
			if (!larger)
				return tw_fail_memory(error);
			*bytes = larger;
		}
		size_t got = fread(*bytes + *size, 1, capacity - 1 - *size, file);
		*size += got;
		if (*size > limit)
			return file_blame(tw_fail(error, TW_ERROR_LIMIT, "file-too-large", NULL,
						  "is larger than %zu bytes", limit),
					  path, error);
		if (!got)
			break;
	}
	(*bytes)[*size] = 0;
	return ferror(file) ? fail_file(path, "read", error) : TW_OK;
}

enum tw_status file_read(const char *path, size_t limit, char **bytes, size_t *size, struct tw_error *error)
{
	*bytes = NULL;
	*size = 0;
	bool standard = !strcmp(path, "-");
	FILE *file = standard ? stdin : fopen(path, "rb");
	if (!file)
		return fail_file(path, "open", error);
	enum tw_status status = read_all(file, path, limit, bytes, size, error);
	if (!standard)
		fclose(file);
	if (status != TW_OK) {
		free(*bytes);
		*bytes = NULL;
	}
	return status;
}

enum tw_status file_write(const char *path, const void *bytes, size_t size, struct tw_error *error)
{
	char *draft;
	if (asprintf(&draft, "%s.part", path) < 0)
		return tw_fail_memory(error);
	FILE *file = fopen(draft, "wb");
	bool written = file && fwrite(bytes, 1, size, file) == size;
	/* Closing writes what is left, so it can fail as well. */
	bool closed = file && fclose(file) == 0;
	enum tw_status status = TW_OK;
	if (!written || !closed || rename(draft, path) != 0) {
		status = fail_file(path, "write", error);
		unlink(draft);
	}
	free(draft);
	return status;
}

static enum tw_status source_read(void *context, void *bytes, size_t size, size_t *got, struct tw_error *error)
{
	struct file_source *opened = context;
	*got = fread(bytes, 1, size, opened->file);
	return *got < size && ferror(opened->file) ? fail_file(NULL, "read the motion", error) : TW_OK;
}

static enum tw_status source_seek(void *context, uint64_t offset, struct tw_error *error)
{
	struct file_source *opened = context;
	return fseeko(opened->file, (off_t)offset, SEEK_SET) ? fail_file(NULL, "seek in the motion", error) : TW_OK;
}

enum tw_status file_source_open(struct file_source *opened, struct byte_source *source, const char *path,
				struct tw_error *error)
{
	opened->file = fopen(path, "rb");
	if (!opened->file)
		return fail_file(path, "open", error);
	struct stat status;
	bool plain = fstat(fileno(opened->file), &status) == 0 && S_ISREG(status.st_mode);
	*source = (struct byte_source){.read = source_read,
				       .seek = source_seek,
				       .context = opened,
				       .size = plain ? (uint64_t)status.st_size : UINT64_MAX};
	return TW_OK;
}

void file_source_close(struct file_source *opened)
{
	if (opened->file)
		fclose(opened->file);
	opened->file = NULL;
}

enum tw_status file_make_folder(const char *path, struct tw_error *error)
{
	char *copy = strdup(path);
	if (!copy)
		return tw_fail_memory(error);
	enum tw_status status = TW_OK;
	for (char *slash = copy + 1; status == TW_OK && *copy; slash++) {
		bool end = *slash == 0;
		if (!end && *slash != '/')
			continue;
		*slash = 0;
		if (mkdir(copy, 0777) != 0 && errno != EEXIST)
			status = fail_file(path, "make the folder", error);
		if (end)
			break;
		*slash = '/';
	}
	free(copy);
	return status;
}

/* With the slash behind it, what is no folder is an error as well. */
static enum tw_status check_folder(const char *path, const char *blamed, const char *doing, struct tw_error *error)
{
	char *inside;
	if (asprintf(&inside, "%s/.", path) < 0)
		return tw_fail_memory(error);
	enum tw_status status = access(inside, W_OK | X_OK) ? fail_file(blamed, doing, error) : TW_OK;
	free(inside);
	return status;
}

enum tw_status file_prepare_folder(const char *path, struct tw_error *error)
{
	enum tw_status status = file_make_folder(path, error);
	return status == TW_OK ? check_folder(path, path, "write into it", error) : status;
}

enum tw_status file_check_writable(const char *path, struct tw_error *error)
{
	struct stat status;
	if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
		errno = EISDIR;
		return fail_file(path, "write", error);
	}
	const char *slash = strrchr(path, '/');
	char *folder = slash ? strndup(path, (size_t)(slash - path)) : strdup(".");
	if (!folder)
		return tw_fail_memory(error);
	enum tw_status checked = check_folder(folder, path, "write", error);
	free(folder);
	return checked;
}
