#include "service/command/instance.h"

#include "service/command/file.h"

#include <stdlib.h>

enum tw_status instance_read(const char *path, struct arena *arena, struct steiner_file *file, struct tw_error *error)
{
	char *bytes;
	size_t length;
	enum tw_status status = file_read(path, INSTANCE_BYTES_MAX, &bytes, &length, error);
	if (status != TW_OK)
		return status;
	status = file_blame(steiner_file_read(file, arena, bytes, length, error), path, error);
	free(bytes);
	if (status == TW_OK && file->loop_count > 0)
		fprintf(stderr,
			"warning: %s: %u edges from a vertex to itself were left out, which no tree has (line %zu%s)\n",
			path, file->loop_count, file->loop_line, file->loop_count > 1 ? ", …" : "");
	if (status == TW_OK && file->repeated_count > 0)
		fprintf(stderr, "warning: %s: %u terminals were listed before, which changes nothing (line %zu%s)\n",
			path, file->repeated_count, file->repeated_line, file->repeated_count > 1 ? ", …" : "");
	if (status == TW_OK && file->fixed > 0)
		fprintf(stderr,
			"warning: %s: the graph is what reductions left of another one, whose tree weighs %llu more "
			"(FIXED)\n",
			path, (unsigned long long)file->fixed);
	return status;
}
