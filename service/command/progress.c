#include "service/command/progress.h"

#include "service/clock.h"

#include <stdbool.h>
#include <unistd.h>

enum { PERIOD_MS = 50 };

static bool shown;
static int64_t next_ms;

void progress_show(const char *format, ...)
{
	int64_t now = monotonic_ms();
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
