#include "service/command/progress.h"

#include <stdbool.h>
#include <time.h>
#include <unistd.h>

enum { PERIOD_MS = 50 };

static bool shown;
static long long next_ms;

static long long now_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (long long)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

void progress_show(const char *format, ...)
{
	long long now = now_ms();
	if (now < next_ms || !isatty(STDERR_FILENO))
		return;
	next_ms = now + PERIOD_MS;
	shown = true;
	va_list arguments;
	va_start(arguments, format);
	fputs("\r\033[K", stderr);
	vfprintf(stderr, format, arguments);
	va_end(arguments);
	fflush(stderr);
}

void progress_clear(void)
{
	if (shown)
		fputs("\r\033[K", stderr);
	shown = false;
	next_ms = 0;
}
