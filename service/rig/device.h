/* The acquisition box of the bench rig: a Modbus device (Modbus Application Protocol 1.1b3) whose registers hold the
 * strain sensors' counts. One connection, opened when it is first needed; not thread-safe. */
#ifndef SERVICE_RIG_DEVICE_H
#define SERVICE_RIG_DEVICE_H

#include "storage/recording.h"
#include "tightwire.h"

#include <stdbool.h>

struct rig_device_options {
	const char *url;     /* borrowed: tcp://HOST:PORT, or rtu:… as in line.h */
	uint32_t unit;       /* Modbus unit (slave) address: 1…247, over TCP also 0 and 255 */
	uint32_t address;    /* of the first register, 0-based */
	int holding;         /* 0: input registers (function 4), 1: holding registers (function 3) */
	uint32_t timeout_ms; /* for a connect and for an answer */
};

struct rig_device;

/* Checks the URL and prepares; does not connect. */
enum tw_status rig_device_new(struct rig_device **device, const struct rig_device_options *options,
			      struct tw_error *error) TW_NODISCARD;
void rig_device_free(struct rig_device *device); /* NULL is allowed */

bool rig_device_is_connected(const struct rig_device *device);

/* Connects; blocks for timeout_ms at most. TW_ERROR_IO says why not. */
enum tw_status rig_device_connect(struct rig_device *device, struct tw_error *error) TW_NODISCARD;

/* Reads RIG_CHANNELS registers. TW_ERROR_UNSUPPORTED is a Modbus exception: the device answered, the connection is
 * good. TW_ERROR_IO is everything else: the connection has been closed, connect again. */
enum tw_status rig_device_scan(struct rig_device *device, uint16_t *registers, struct tw_error *error) TW_NODISCARD;

#endif
