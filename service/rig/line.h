/* A serial line to a Modbus RTU device, as a URL says it. */
#ifndef SERVICE_RIG_LINE_H
#define SERVICE_RIG_LINE_H

#include "tightwire.h"

#define RIG_LINE_USAGE                                                                                                 \
	"rtu:/dev/NAME, or rtu:/dev/NAME?baud=115200&parity=even&data=8&stop=1 with parity none, even or odd, "        \
	"7 or 8 data bits, 1 or 2 stop bits"

struct rig_line {
	char path[256];
	int baud;      /* 115200 unless the URL says otherwise; one that the kernel's lines have */
	char parity;   /* 'N', 'E' or 'O'; even unless … */
	int data_bits; /* 7 or 8; 8 unless … */
	int stop_bits; /* 1 or 2; 1 unless … */
};

/* `place` is the URL behind "rtu:". TW_ERROR_INPUT "rig-device" says what is wrong with which part. */
enum tw_status rig_line_parse(const char *place, struct rig_line *line, struct tw_error *error) TW_NODISCARD;

#endif
