/* libmodbus 3.1.6 cannot be trusted after an error: its default mode answers EPIPE for ever once the peer died, its
 * link recovery sleeps for more than a second, and after a hang it takes late answers for wrong ones. So its recovery
 * stays off, and every error that is not a Modbus exception closes the connection; when to connect again is the
 * caller's affair. */
#include "service/rig/device.h"

#include "service/host_port.h"
#include "service/rig/line.h"

#include <errno.h>
#include <modbus.h>
#include <stdlib.h>
#include <string.h>

struct rig_device {
	struct rig_device_options options;
	modbus_t *modbus; /* owned */
	bool connected;
};

static modbus_t *new_tcp(const char *place, struct tw_error *error)
{
	struct host_port parts;
	if (!host_port_parse(&parts, place) || !parts.host[0] || !parts.number) {
		(void)tw_fail(error, TW_ERROR_INPUT, "rig-device", place,
			      "the device must be tcp://HOST:PORT, with a port from 1 to 65535");
		return NULL;
	}
	modbus_t *modbus = modbus_new_tcp_pi(parts.host, parts.port);
	if (!modbus)
		(void)tw_fail(error, TW_ERROR_INPUT, "rig-device", place, "not a host and port: %s",
			      modbus_strerror(errno));
	return modbus;
}

static modbus_t *new_rtu(const char *place, struct tw_error *error)
{
	struct rig_line line;
	if (rig_line_parse(place, &line, error) != TW_OK)
		return NULL;
	modbus_t *modbus = modbus_new_rtu(line.path, line.baud, line.parity, line.data_bits, line.stop_bits);
	if (!modbus)
		(void)tw_fail(error, TW_ERROR_INPUT, "rig-device", "--device", "%s is no serial line: %s", line.path,
			      modbus_strerror(errno));
	return modbus;
}

static modbus_t *new_modbus(const char *url, struct tw_error *error)
{
	if (!strncmp(url, "tcp://", 6))
		return new_tcp(url + 6, error);
	if (!strncmp(url, "rtu:", 4))
		return new_rtu(url + 4, error);
	(void)tw_fail(error, TW_ERROR_INPUT, "rig-device", url,
		      "the device must be tcp://HOST:PORT or " RIG_LINE_USAGE);
	return NULL;
}

/* Modbus over Serial Line 1.02, 2.2: units have 1 to 247, 0 is a broadcast that nobody answers, the rest is reserved.
 * Modbus TCP has no need of a unit: 255, or 0, is the device itself (MODBUS Messaging on TCP/IP 1.0b, 4.4.2). */
static enum tw_status check_unit(const struct rig_device_options *options, struct tw_error *error)
{
	bool serial = !strncmp(options->url, "rtu:", 4);
	bool device_itself = !serial && (options->unit == 0 || options->unit == 255);
	if ((options->unit >= 1 && options->unit <= 247) || device_itself)
		return TW_OK;
	return tw_fail(
		error, TW_ERROR_INPUT, "rig-device", "--unit",
		serial ? "no device answers to unit %u: on a serial line units are 1 to 247"
		       : "no device answers to unit %u: units are 1 to 247, and 0 or 255 for the TCP device itself",
		options->unit);
}

enum tw_status rig_device_new(struct rig_device **device, const struct rig_device_options *options,
			      struct tw_error *error)
{
	if (options->address > 65536 - RIG_CHANNELS)
		return tw_fail(error, TW_ERROR_INPUT, "rig-device", "--address",
			       "the %d registers from %u on do not lie below 65536", RIG_CHANNELS, options->address);
	enum tw_status status = check_unit(options, error);
	if (status != TW_OK)
		return status;
	struct rig_device *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->options = *options;
	made->modbus = new_modbus(options->url, error);
	if (!made->modbus) {
		free(made);
		return TW_ERROR_INPUT;
	}
	uint32_t seconds = options->timeout_ms / 1000, microseconds = options->timeout_ms % 1000 * 1000;
	modbus_set_response_timeout(made->modbus, seconds, microseconds);
	modbus_set_byte_timeout(made->modbus, seconds, microseconds);
	modbus_set_error_recovery(made->modbus, MODBUS_ERROR_RECOVERY_NONE);
	if (modbus_set_slave(made->modbus, (int)options->unit)) {
		rig_device_free(made);
		return tw_fail(error, TW_ERROR_INPUT, "rig-device", "unit", "%u is no unit address", options->unit);
	}
	*device = made;
	return TW_OK;
}

static void disconnect(struct rig_device *device)
{
	if (device->connected)
		modbus_close(device->modbus);
	device->connected = false;
}

void rig_device_free(struct rig_device *device)
{
	if (!device)
		return;
	disconnect(device);
	modbus_free(device->modbus);
	free(device);
}

bool rig_device_is_connected(const struct rig_device *device)
{
	return device->connected;
}

enum tw_status rig_device_connect(struct rig_device *device, struct tw_error *error)
{
	disconnect(device);
	errno = 0; /* modbus_connect leaves it alone when it times out */
	if (modbus_connect(device->modbus)) {
		int reason = errno ? errno : ETIMEDOUT;
		modbus_close(device->modbus);
		return tw_fail(error, TW_ERROR_IO, "rig-unreachable", device->options.url, "cannot connect to %s: %s",
			       device->options.url, modbus_strerror(reason));
	}
	device->connected = true;
	return TW_OK;
}

/* libmodbus numbers the exceptions of the protocol from EMBXILFUN on; what lies above EMBXGTAR are its own complaints.
 */
static bool is_exception(int reason)
{
	return reason >= EMBXILFUN && reason <= EMBXGTAR;
}

enum tw_status rig_device_scan(struct rig_device *device, uint16_t *registers, struct tw_error *error)
{
	const struct rig_device_options *o = &device->options;
	errno = 0;
	int got = o->holding ? modbus_read_registers(device->modbus, (int)o->address, RIG_CHANNELS, registers)
			     : modbus_read_input_registers(device->modbus, (int)o->address, RIG_CHANNELS, registers);
	if (got == RIG_CHANNELS)
		return TW_OK;
	int reason = errno ? errno : ETIMEDOUT;
	if (got < 0 && is_exception(reason))
		return tw_fail(error, TW_ERROR_UNSUPPORTED, "rig-exception", o->url,
			       "the device refuses registers %u to %u: %s", o->address, o->address + RIG_CHANNELS - 1,
			       modbus_strerror(reason));
	disconnect(device);
	return tw_fail(error, TW_ERROR_IO, "rig-unreachable", o->url, "no answer from %s: %s", o->url,
		       modbus_strerror(reason));
}
