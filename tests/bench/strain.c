/* Strain of frames: time of a frame, and throughput beside what the machine's memory gives in the same run. */
#include "solver/field/strain.h"
#include "solver/sample/sample.h"

#include "tests/bench/bench.h"

#include <string.h>

enum { VERTICES = 23500, FRAMES = 64, ROUNDS = 16 };

int main(void)
{
	struct arena *arena = arena_new(0);
	struct garment garment;
	if (sample_garment(&garment, arena, VERTICES, SAMPLE_L, NULL))
		return 1;
	struct strain_rest rest;
	struct strain_mean *mean;
	double *means[STRAIN_MODELS];
	for (int m = 0; m < STRAIN_MODELS; m++)
		means[m] = ARENA_ARRAY(arena, garment.face_count, double);
	if (strain_rest_from_pattern(&rest, arena, &garment, NULL) || strain_mean_new(&mean, arena, &rest, NULL))
		return 1;
	size_t floats = 3 * (size_t)garment.vertex_count, bytes = floats * sizeof(float);
	float *motion = ARENA_ARRAY(arena, floats * FRAMES, float);
	for (size_t i = 0; i < floats * FRAMES; i++)
		motion[i] = (float)(garment.position[i % floats] * (1 + 0.002 * (double)(i / floats)));

	double read_best = 1e9, frame_best = 1e9, once_best = 1e9;
	for (int round = 0; round < ROUNDS; round++) {
		double read_s = bench_read_seconds(bytes);
		double frame_s = 0, start;
		for (int j = 0; j < FRAMES; j++) {
			memcpy(strain_mean_slot(mean), motion + (size_t)j * floats, bytes);
			start = bench_seconds();
			strain_mean_add(mean);
			frame_s += (bench_seconds() - start) / FRAMES;
		}
		strain_mean_finish(mean, means);
		start = bench_seconds();
		strain_density(&rest, STRAIN_STVK, motion, means[0]);
		double once_s = bench_seconds() - start;
		read_best = read_s < read_best ? read_s : read_best;
		frame_best = frame_s < frame_best ? frame_s : frame_best;
		once_best = once_s < once_best ? once_s : once_best;
	}
	bench_line("strain.vertices", garment.vertex_count, "", 0);
	bench_line("strain.read_frame_from_memory", read_best * 1e3, "ms", 0);
	bench_line("strain.frame_in_motion", frame_best * 1e3, "ms", 0.5);
	bench_line("strain.frame_alone", once_best * 1e3, "ms", 0.5);
	/* What it does read and write: its positions, and its share of what a block of frames reads once: corners (6
	 * bytes a face), rest shapes (12), three sums (24, read and written), and the list of vertices (4 a vertex). */
	double touched = (double)bytes + (66.0 * garment.face_count + 4.0 * garment.vertex_count) / STRAIN_BLOCK;
	bench_line("strain.frame_over_reading_positions", frame_best / read_best, "x", 0);
	/* What a frame alone would have to read: positions, and the mesh's indices (12 bytes a face). */
	double indexed = (double)bytes + 12.0 * garment.face_count;
	bench_line("strain.frame_over_reading_indices_too", frame_best / read_best * (double)bytes / indexed, "x", 2.5);
	bench_line("strain.frame_over_reading_same_bytes", frame_best / read_best * (double)bytes / touched, "x", 2.5);
	bench_line("strain.throughput", (double)bytes / frame_best / 1e9, "GB/s", -1);
	arena_free(arena);
	return 0;
}
