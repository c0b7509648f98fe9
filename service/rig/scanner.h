/* A thread that scans the acquisition box at a fixed rate into a ring, so that a slow disk never delays a scan and a
 * device that hangs never delays the store. What could not be scanned in its slot is a gap: nothing is interpolated. */
#ifndef SERVICE_RIG_SCANNER_H
#define SERVICE_RIG_SCANNER_H

#include "service/rig/device.h"
#include "storage/recording.h"
#include "tightwire.h"

#include <stdbool.h>

struct rig_scanner_state {
	bool connected;
	uint64_t scans;      /* slots that gave a sample */
	uint64_t gaps;       /* slots that gave none */
	uint64_t exceptions; /* Modbus exceptions among the gaps */
	uint64_t connects;   /* times a connection was made */
	uint64_t dropped;    /* samples that the ring overwrote before they were taken */
	char problem[256];   /* why there is no connection or no sample; empty when all is well */
};

struct rig_scanner;

/* Starts the thread. The device is borrowed until rig_scanner_stop. `rate_hz` 1…1000. */
enum tw_status rig_scanner_start(struct rig_scanner **scanner, struct rig_device *device, uint32_t rate_hz,
				 struct tw_error *error) TW_NODISCARD;
void rig_scanner_stop(struct rig_scanner *scanner); /* joins and frees; NULL is allowed */

/* Takes up to `most` samples, oldest first; returns how many. */
size_t rig_scanner_take(struct rig_scanner *scanner, struct rig_sample *samples, size_t most);

void rig_scanner_state(struct rig_scanner *scanner, struct rig_scanner_state *state);

#endif
