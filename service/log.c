#include "service/log.h"

#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

static atomic_int log_level = LOG_LEVEL_INFO;

void log_set_level(enum log_level level)
{
	atomic_store(&log_level, (int)level);
}

static size_t print_time(char *line, size_t size)
{
	struct timespec now;
	struct tm parts;
	clock_gettime(CLOCK_REALTIME, &now);
	gmtime_r(&now.tv_sec, &parts);
	size_t used = strftime(line, size, "%Y-%m-%dT%H:%M:%S", &parts);
	return used + (size_t)snprintf(line + used, size - used, ".%03dZ", (int)(now.tv_nsec / 1000000));
}

void log_event(enum log_level level, const char *event, const char *format, ...)
{
	static const char *const names[] = {"error", "warning", "info", "debug"};
	char line[1024];
	if ((int)level > atomic_load(&log_level))
		return;
	size_t used = print_time(line, sizeof line);
	used += (size_t)snprintf(line + used, sizeof line - used, " %s %s ", names[level], event);
	va_list arguments;
	va_start(arguments, format);
	int length = vsnprintf(line + used, sizeof line - used, format, arguments);
	va_end(arguments);
	used += length < 0 ? 0 : (size_t)length;
	if (used > sizeof line - 1)
		used = sizeof line - 1;
	for (size_t i = 0; i < used; i++)
		if ((unsigned char)line[i] < ' ' || line[i] == 127)
			line[i] = '?';
	line[used++] = '\n';
	/* A log that cannot be written has nowhere to say so. */
	if (write(STDERR_FILENO, line, used) < 0)
		return;
}

void log_error(const char *event, const struct tw_error *error)
{
	log_event(LOG_LEVEL_ERROR, event, "type=%s where=\"%s\" text=\"%s\"", error->type ? error->type : "-",
		  error->where, error->text);
}
