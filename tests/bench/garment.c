/* Import of the sample suit from OBJ, usual and large, and motions: reading PC2, packing, unpacking. */
#include "solver/garment/import.h"
#include "solver/motion/pack.h"
#include "solver/sample/sample.h"

#include "tests/bench/bench.h"

#include <string.h>
#include <sys/resource.h>

enum { VERTICES = 23500, LARGE_VERTICES = 727000, FRAMES = 200 };

static char *write_obj(const struct garment *g, size_t *size)
{
	char *text = NULL;
	FILE *out = open_memstream(&text, size);
	for (uint32_t v = 0; v < g->vertex_count; v++)
		fprintf(out, "v %.4f %.4f %.4f\n", g->position[3 * v], g->position[3 * v + 1], g->position[3 * v + 2]);
	for (uint32_t c = 0; c < g->coord_count; c++)
		fprintf(out, "vt %.4f %.4f\n", g->pattern[2 * c], g->pattern[2 * c + 1]);
	for (uint32_t f = 0; f < g->face_count; f++) {
		const uint32_t *v = g->face_vertex + 3 * f, *c = g->face_coord + 3 * f;
		fprintf(out, "f %u/%u %u/%u %u/%u\n", v[0] + 1, c[0] + 1, v[1] + 1, c[1] + 1, v[2] + 1, c[2] + 1);
	}
	fclose(out);
	return text;
}

static double import_seconds(const char *text, size_t size)
{
	struct arena *arena = arena_new(0);
	struct garment garment;
	struct garment_report report;
	struct import_options options;
	option_defaults(&import_option_table, &options);
	struct garment_source source = {.bytes = text, .size = size};
	double start = bench_seconds();
	if (garment_import(&garment, arena, &source, NULL, &options, &report, NULL) != TW_OK)
		exit(1);
	double seconds = bench_seconds() - start;
	arena_free(arena);
	return seconds;
}

/* Last of all, since a process remembers its peak. The file's bytes are in memory, as they are for an import job. */
static void import_large(void)
{
	struct arena *arena = arena_new(0);
	struct garment garment;
	size_t size = 0;
	if (sample_garment(&garment, arena, LARGE_VERTICES, SAMPLE_L, NULL) != TW_OK)
		exit(1);
	char *text = write_obj(&garment, &size);
	arena_free(arena);
	struct rusage usage;
	bench_line("garment.import_large_obj", import_seconds(text, size), "s", 10);
	getrusage(RUSAGE_SELF, &usage);
	bench_line("garment.large_process_memory", (double)usage.ru_maxrss / 1048576, "GiB", 2);
	free(text);
}

static unsigned char *write_pc2(const struct garment *garment, struct arena *arena, size_t *size)
{
	struct sample_rig *rig = NULL;
	const size_t frame = 12 * (size_t)garment->vertex_count;
	*size = PC2_HEADER_BYTES + FRAMES * frame;
	unsigned char *bytes = arena_array(arena, *size, 1);
	float *position = arena_array(arena, frame, 1);
	if (!bytes || !position || sample_rig_build(&rig, arena, garment, SAMPLE_L, NULL) != TW_OK)
		exit(1);
	pc2_write_header(bytes, garment->vertex_count, FRAMES);
	for (uint32_t i = 0; i < FRAMES; i++) {
		sample_rig_pose(rig, 0, i % sample_motion_at(0)->frame_count, position);
		memcpy(bytes + PC2_HEADER_BYTES + i * frame, position, frame);
	}
	return bytes;
}

/* Seconds to read a whole motion; the reader stands at its start afterwards. */
static double read_seconds(struct motion_reader *reader, float *position)
{
	bool end = false;
	double start = bench_seconds();
	while (!end) {
		if (motion_next(reader, position, &end, NULL) != TW_OK)
			exit(1);
	}
	double seconds = bench_seconds() - start;
	if (motion_rewind(reader, NULL) != TW_OK)
		exit(1);
	return seconds;
}

static struct motion_reader *open_memory(struct byte_memory *memory)
{
	struct byte_source source = byte_source_memory(memory);
	struct motion_reader *reader = NULL;
	if (motion_open(&reader, &source, MOTION_SNIFF, UNIT_MM, 0, NULL) != TW_OK)
		exit(1);
	return reader;
}

static enum tw_status take(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	(void)error;
	struct byte_memory *packed = context;
	memcpy((char *)packed->bytes + packed->size, bytes, size);
	packed->size += size;
	return TW_OK;
}

int main(void)
{
	struct arena *arena = arena_new(0);
	struct garment garment;
	size_t text_size = 0, pc2_size = 0;
	if (sample_garment(&garment, arena, VERTICES, SAMPLE_L, NULL) != TW_OK)
		return 1;
	char *text = write_obj(&garment, &text_size);
	import_seconds(text, text_size);
	bench_line("garment.import_obj", import_seconds(text, text_size), "s", 0);
	free(text);

	struct byte_memory pc2 = {.bytes = write_pc2(&garment, arena, &pc2_size), .size = pc2_size};
	struct byte_memory packed = {.bytes = arena_array(arena, pc2_size, 1)};
	float *position = ARENA_ARRAY(arena, 3 * (size_t)garment.vertex_count, float);
	struct motion_reader *reader = open_memory(&pc2);
	read_seconds(reader, position);
	bench_line("motion.read_pc2", (double)pc2.size / read_seconds(reader, position) / 1e9, "GB/s", -1);
	uint32_t frames = 0;
	double start = bench_seconds();
	if (motion_pack(reader, take, &packed, &frames, NULL) != TW_OK)
		return 1;
	bench_line("motion.pack", (double)pc2.size / (bench_seconds() - start) / 1e6, "MB/s", 0);
	bench_line("motion.packed_share", (double)packed.size / (double)pc2.size, "x", 0.3);
	motion_close(reader);
	reader = open_memory(&packed);
	bench_line("motion.unpack", (double)pc2.size / read_seconds(reader, position) / 1e6, "MB/s", 0);
	motion_close(reader);
	arena_free(arena);
	import_large();
	return 0;
}
