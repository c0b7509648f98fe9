#include "service/rig/clock.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

static int64_t read_us(clockid_t clock)
{
	struct timespec t;
	clock_gettime(clock, &t);
	return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

int64_t rig_clock_us(void)
{
	return read_us(CLOCK_BOOTTIME);
}

int64_t rig_clock_wall_offset_us(void)
{
	return read_us(CLOCK_REALTIME) - read_us(CLOCK_BOOTTIME);
}

void rig_clock_boot(char boot[RIG_BOOT_SIZE])
{
	FILE *file = fopen("/proc/sys/kernel/random/boot_id", "r");
	boot[0] = '\0';
	if (!file)
		return;
	if (!fgets(boot, RIG_BOOT_SIZE, file))
		boot[0] = '\0';
	boot[strcspn(boot, "\n")] = '\0';
	fclose(file);
}
