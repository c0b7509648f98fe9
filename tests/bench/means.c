/* A thousand frames of the sample suit, from a PC2 file that is in the system's cache to the mean densities of every
 * face, on one core. */
#include "solver/field/means.h"
#include "service/command/file.h"
#include "solver/sample/sample.h"

#include "tests/bench/bench.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

enum { VERTICES = 23500, FRAMES = 250, READINGS = 4 };

static uint32_t write_frames(FILE *file, const struct garment *garment, struct arena *arena)
{
	char header[PC2_HEADER_BYTES];
	struct sample_rig *rig;
	size_t floats = 3 * (size_t)garment->vertex_count;
	float *position = ARENA_ARRAY(arena, floats, float);
	if (sample_rig_build(&rig, arena, garment, SAMPLE_L, NULL) || !position)
		exit(1);
	fwrite(header, 1, pc2_write_header(header, garment->vertex_count, FRAMES), file);
	uint32_t poses = sample_motion_at(0)->frame_count;
	for (uint32_t j = 0; j < FRAMES; j++) {
		if (j < poses) /* one walk, and then its last pose */
			sample_rig_pose(rig, 0, j, position);
		fwrite(position, sizeof *position, floats, file);
	}
	return FRAMES;
}

static double read_means(const char *path, const struct garment *garment, struct arena *arena, double *const *means)
{
	struct field_options options;
	struct file_source file;
	struct byte_source source;
	struct motion_reader *reader;
	struct means_report report;
	option_defaults(&field_option_table, &options);
	double start = bench_seconds();
	for (int k = 0; k < READINGS; k++) {
		if (file_source_open(&file, &source, path, NULL) ||
		    motion_open(&reader, &source, MOTION_PC2, UNIT_MM, garment->vertex_count, NULL) ||
		    means_of_motion(means, &report, arena, garment, reader, &options, NULL, NULL, NULL) ||
		    report.frame_count != FRAMES)
			exit(1);
		motion_close(reader);
		file_source_close(&file);
	}
	return bench_seconds() - start;
}

int main(void)
{
	char path[] = "/tmp/tightwire-bench-XXXXXX";
	int descriptor = mkstemp(path);
	FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "wb");
	struct arena *arena = arena_new(0);
	struct garment garment;
	if (!file || sample_garment(&garment, arena, VERTICES, SAMPLE_L, NULL))
		return 1;
	write_frames(file, &garment, arena);
	if (fclose(file))
		return 1;
	double *means[STRAIN_MODELS], seconds = INFINITY;
	for (int m = 0; m < STRAIN_MODELS; m++)
		means[m] = ARENA_ARRAY(arena, garment.face_count, double);
	for (int round = 0; round < 3; round++)
		seconds = fmin(seconds, read_means(path, &garment, arena, means));
	unlink(path);
	double bytes = 12.0 * garment.vertex_count * FRAMES * READINGS;
	bench_line("means.frames", FRAMES * READINGS, "", 0);
	bench_line("means.frame", seconds / (FRAMES * READINGS) * 1e3, "ms", 3);
	bench_line("means.positions_per_core", bytes / seconds / 1e9, "GB/s", -1);
	arena_free(arena);
	return 0;
}
