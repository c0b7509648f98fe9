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
	int64_t slot; /* the last one that came due: all before it are done with */
	struct rig_counts counts;
	char problem[256]; /* why there is no connection or no sample; empty when all is well */
};

/* A slot that gave a sample. Slots are numbered by the rig's clock (clock.h): slot n is due n periods after boot, so
 * that processes that follow one another at the same rate have the same slots. */
struct rig_scan {
	int64_t slot;
	struct rig_sample sample; /* at_us by the rig's clock, when the box answered */
};

struct rig_scanner;

/* Starts the thread. The device is borrowed until rig_scanner_stop. `rate_hz` is 1…1000. */
enum tw_status rig_scanner_start(struct rig_scanner **scanner, struct rig_device *device, uint32_t rate_hz,
				 struct tw_error *error) TW_NODISCARD;
void rig_scanner_stop(struct rig_scanner *scanner); /* joins and frees; NULL is allowed */

uint32_t rig_scanner_rate_hz(const struct rig_scanner *scanner);

/* The first slot that is not due yet, of a rate, at a time of the rig's clock; and when a slot is due. */
int64_t rig_slot_after(uint32_t rate_hz, int64_t now_us);
int64_t rig_slot_due_us(uint32_t rate_hz, int64_t slot);

/* Takes up to `most` scans, oldest first; returns how many. */
size_t rig_scanner_take(struct rig_scanner *scanner, struct rig_scan *scans, size_t most);

void rig_scanner_state(struct rig_scanner *scanner, struct rig_scanner_state *state);

#endif
