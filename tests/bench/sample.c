/* Making the sample suit: seconds by resolution, and a frame of its motion. */
#include "solver/sample/sample.h"

#include "tests/bench/bench.h"

int main(void)
{
	static const struct {
		uint32_t vertices;
		const char *name;
		double goal_s;
	} suits[] = {{3000, "sample.3000_vertices", 1},
		     {23500, "sample.23500_vertices", 5},
		     {727000, "sample.727000_vertices", 60}};
	for (size_t i = 0; i < sizeof suits / sizeof *suits; i++) {
		struct arena *arena = arena_new(0);
		struct garment garment;
		double start = bench_seconds();
		if (sample_garment(&garment, arena, suits[i].vertices, SAMPLE_L, NULL))
			return 1;
		bench_line(suits[i].name, bench_seconds() - start, "s", suits[i].goal_s);
		arena_free(arena);
	}
	struct arena *arena = arena_new(0);
	struct garment garment;
	struct sample_rig *rig;
	if (sample_garment(&garment, arena, 23500, SAMPLE_L, NULL) ||
	    sample_rig_build(&rig, arena, &garment, SAMPLE_L, NULL))
		return 1;
	float *position = ARENA_ARRAY(arena, 3 * (size_t)garment.vertex_count, float);
	double start = bench_seconds();
	for (uint32_t frame = 0; frame < 20; frame++)
		sample_rig_pose(rig, 0, frame, position);
	bench_line("sample.frame_of_23500_vertices", (bench_seconds() - start) / 20 * 1e3, "ms", 0);
	arena_free(arena);
	return 0;
}
