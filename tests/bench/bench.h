/* What benches share: a clock, the machine's memory as a yardstick, and a line `name value unit goal verdict`. */
#ifndef TESTS_BENCH_BENCH_H
#define TESTS_BENCH_BENCH_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* Processor time of this thread: other work on the machine does not show in it. */
static inline double bench_seconds(void)
{
	struct timespec now;
	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
	return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static inline double bench_wall_seconds(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* Seconds that reading `bytes` from memory takes, where they are in no cache: a sum over a buffer that is larger than
 * any. */
static inline double bench_read_seconds(size_t bytes)
{
	enum { WORDS = 1 << 25 };
	static uint64_t *buffer;
	static volatile uint64_t sink;
	if (!buffer) {
		buffer = malloc(WORDS * sizeof *buffer);
		if (!buffer)
			abort();
		for (size_t i = 0; i < WORDS; i++)
			buffer[i] = i;
	}
	uint64_t sum[8] = {0};
	double start = bench_seconds();
	for (size_t i = 0; i < WORDS; i += 8)
		for (size_t k = 0; k < 8; k++)
			sum[k] += buffer[i + k];
	double seconds = bench_seconds() - start;
	for (size_t k = 0; k < 8; k++)
		sink = sink + sum[k];
	return seconds * (double)bytes / (WORDS * sizeof *buffer);
}

/* `goal` > 0: at most that; < 0: at least its magnitude; 0: none. */
static inline void bench_line(const char *name, double value, const char *unit, double goal)
{
	char text[32] = "";
	if (goal > 0)
		snprintf(text, sizeof text, "<= %g", goal);
	if (goal < 0)
		snprintf(text, sizeof text, ">= %g", -goal);
	const char *verdict = goal == 0 ? "" : (goal > 0 ? value <= goal : value >= -goal) ? "ok" : "MISSED";
	printf("%-36s %12.4g %-6s %-10s %s\n", name, value, unit, text, verdict);
	fflush(stdout);
}

#endif
