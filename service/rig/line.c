#include "service/rig/line.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* What libmodbus 3.1.6 sets; any other it would take for 9600 without a word. */
static const int bauds[] = {1200,    2400,    4800,    9600,    19200,   38400,   57600,
			    115200,  230400,  460800,  500000,  576000,  921600,  1000000,
			    1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

static enum tw_status refuse(const char *what, size_t length, const char *why, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "rig-device", "--device",
		       "\"%.*s\" %s; the device must be " RIG_LINE_USAGE, (int)(length > 80 ? 80 : length), what, why);
}

static bool is_baud(long baud)
{
	size_t i = 0;
	while (i < sizeof bauds / sizeof *bauds && bauds[i] != baud)
		i++;
	return i < sizeof bauds / sizeof *bauds;
}

/* The whole of `text` as a number; -1 where it is none. */
static long number_of(const char *text, size_t length)
{
	char *end = NULL;
	long value = length > 0 && length < 9 && text[0] >= '0' && text[0] <= '9' ? strtol(text, &end, 10) : -1;
	return end == text + length ? value : -1;
}

/* "KEY=": how long that is where `text` begins with it, else 0. */
static size_t key_length(const char *text, const char *key)
{
	size_t length = strlen(key);
	return !strncmp(text, key, length) && text[length] == '=' ? length + 1 : 0;
}

static bool set_parity(struct rig_line *line, const char *value, size_t length)
{
	static const char *const names[] = {"none", "even", "odd"};
	for (size_t i = 0; i < 3; i++)
		if (strlen(names[i]) == length && !strncmp(value, names[i], length)) {
			line->parity = "NEO"[i];
			return true;
		}
	return false;
}

/* One KEY=VALUE of `length` bytes. */
static enum tw_status set(struct rig_line *line, const char *text, size_t length, struct tw_error *error)
{
	size_t key = 0;
	if ((key = key_length(text, "baud")) > 0) {
		long baud = number_of(text + key, length - key);
		line->baud = (int)baud;
		return is_baud(baud) ? TW_OK : refuse(text, length, "is no rate of a serial line", error);
	}
	if ((key = key_length(text, "parity")) > 0)
		return set_parity(line, text + key, length - key) ? TW_OK : refuse(text, length, "is no parity", error);
	if ((key = key_length(text, "data")) > 0) {
		line->data_bits = (int)number_of(text + key, length - key);
		return line->data_bits == 7 || line->data_bits == 8 ? TW_OK : refuse(text, length, "cannot be", error);
	}
	if ((key = key_length(text, "stop")) > 0) {
		line->stop_bits = (int)number_of(text + key, length - key);
		return line->stop_bits == 1 || line->stop_bits == 2 ? TW_OK : refuse(text, length, "cannot be", error);
	}
	return refuse(text, length, "is none of baud, parity, data and stop", error);
}

enum tw_status rig_line_parse(const char *place, struct rig_line *line, struct tw_error *error)
{
	size_t length = strcspn(place, "?");
	*line = (struct rig_line){.baud = 115200, .parity = 'E', .data_bits = 8, .stop_bits = 1};
	if (length == 0 || length >= sizeof line->path)
		return refuse(place, length, "names no line", error);
	memcpy(line->path, place, length);
	const char *part = place + length;
	while (*part) {
		part++; /* the "?" or "&" */
		length = strcspn(part, "&");
		enum tw_status status = set(line, part, length, error);
		if (status != TW_OK)
			return status;
		part += length;
	}
	return TW_OK;
}
