/* An acquisition box on a serial line, without libmodbus: the far end of a pseudo-terminal that answers Modbus RTU
 * (Modbus over Serial Line 1.02) as the unit that it is told. Register c reads (scans + 10 c) mod 1024.
 *
 *     rtu_box UNIT
 *
 * Prints the line's path; then, for every request that it answers, how the line is set: "BAUD STOP_BITS ODD". Ends
 * with its standard input. A pseudo-terminal keeps rate, stop bits and odd; parity and 7 bits it cannot have. */
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

enum { REQUEST_BYTES = 8, READ_INPUT = 4 };

/* Polynomial x^16 + x^15 + x^2 + 1, reflected. */
static uint16_t crc(const uint8_t *bytes, size_t size)
{
	uint16_t value = 0xFFFF;
	for (size_t i = 0; i < size; i++) {
		value = (uint16_t)(value ^ bytes[i]);
		for (int bit = 0; bit < 8; bit++)
			value = (uint16_t)(value & 1 ? value >> 1 ^ 0xA001 : value >> 1);
	}
	return value;
}

static bool is_whole(const uint8_t *frame, size_t size)
{
	uint16_t expected = crc(frame, size - 2);
	return frame[size - 2] == (expected & 0xFF) && frame[size - 1] == expected >> 8;
}

static const char *baud_name(speed_t speed)
{
	return speed == B9600 ? "9600" : speed == B57600 ? "57600" : speed == B115200 ? "115200" : "another";
}

static void print_line(int line)
{
	struct termios now;
	if (tcgetattr(line, &now) == 0)
		printf("%s %d %d\n", baud_name(cfgetospeed(&now)), now.c_cflag & CSTOPB ? 2 : 1,
		       (now.c_cflag & PARODD) != 0);
	fflush(stdout);
}

static void answer(int line, const uint8_t *request, unsigned scans)
{
	uint8_t frame[256] = {request[0], request[1]};
	unsigned first = (unsigned)(request[2] << 8 | request[3]), count = (unsigned)(request[4] << 8 | request[5]);
	if (count > 120)
		return;
	frame[2] = (uint8_t)(2 * count);
	for (unsigned c = 0; c < count; c++) {
		unsigned value = (scans + 10 * (first + c)) % 1024;
		frame[3 + 2 * c] = (uint8_t)(value >> 8);
		frame[4 + 2 * c] = (uint8_t)value;
	}
	size_t size = 3 + 2 * count;
	uint16_t check = crc(frame, size);
	frame[size++] = (uint8_t)check;
	frame[size++] = (uint8_t)(check >> 8);
	if (write(line, frame, size) != (ssize_t)size)
		exit(1);
}

int main(int argc, char **argv)
{
	int line = posix_openpt(O_RDWR | O_NOCTTY);
	unsigned unit = argc > 1 ? (unsigned)strtoul(argv[1], NULL, 10) : 1, scans = 0;
	uint8_t request[REQUEST_BYTES];
	size_t got = 0;
	if (line < 0 || grantpt(line) || unlockpt(line))
		return 1;
	/* Held open, or the line would hang up whenever nobody else has it. */
	int other_end = open(ptsname(line), O_RDWR | O_NOCTTY);
	struct termios raw;
	tcgetattr(other_end, &raw);
	cfmakeraw(&raw);
	tcsetattr(other_end, TCSANOW, &raw);
	printf("%s\n", ptsname(line));
	fflush(stdout);
	for (;;) {
		struct pollfd ready[] = {{.fd = line, .events = POLLIN}, {.fd = STDIN_FILENO, .events = POLLIN}};
		if (poll(ready, 2, -1) < 0 || ready[1].revents)
			return 0;
		ssize_t part = read(line, request + got, sizeof request - got);
		if (part <= 0)
			return 1;
		got += (size_t)part;
		if (got < sizeof request)
			continue;
		got = 0;
		if (request[0] == unit && request[1] == READ_INPUT && is_whole(request, sizeof request)) {
			print_line(line);
			answer(line, request, scans++);
		}
	}
}
