/* tightwire sample: writes a suit, its motions and terminal sets, as they would come from garment CAD. */
#include "solver/sample/sample.h"
#include "service/command/command.h"
#include "service/command/file.h"
#include "service/command/progress.h"
#include "solver/motion/motion.h"
#include "solver/option.h"

#include <errno.h>
#include <jansson.h>
#include <stdbool.h>
#include <string.h>

struct request {
	const char *directory; /* borrowed from argv */
	uint32_t vertices;
	int size; /* enum sample_size */
	bool json, help;
};

static const char *const size_names[] = {"M", "L", "XL", NULL};

static const struct option rows[] = {
	{"vertices", OPTION_INTEGER, offsetof(struct request, vertices), NULL, 23500, SAMPLE_VERTICES_MIN,
	 SAMPLE_VERTICES_MAX, NULL, "about so many, within 1.5 %"},
	{"size", OPTION_CHOICE, offsetof(struct request, size), NULL, SAMPLE_L, 0, 0, size_names,
	 "wearer of 170, 175 or 182 cm"},
	{"json", OPTION_FLAG, offsetof(struct request, json), NULL, 0, 0, 0, NULL, "say what was written as JSON"},
	{"help", OPTION_FLAG, offsetof(struct request, help), NULL, 0, 0, 0, NULL, "this text"},
};
static const struct option_table table = {rows, sizeof rows / sizeof *rows};

static void print_help(void)
{
	printf("usage: tightwire sample --out DIR [options]\n\n"
	       "Writes a full-body tight suit to try tightwire with:\n"
	       "  suit.obj                worn mesh, mm, with the flat pattern as vt and a group for each piece\n"
	       "  motions/NAME.pc2        %d motions, 30 frames a second\n"
	       "  terminals/NAME.json     %d terminal sets\n\n"
	       "  --out DIR\n      folder to write to; made where it is missing\n",
	       SAMPLE_MOTIONS, SAMPLE_TERMINAL_SETS);
	option_print_help(&table, stdout);
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct request *request = context;
	option_defaults(&table, request);
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		enum tw_status status = option_from_arguments(&table, request, argc, argv, &i, &taken, error);
		if (status == TW_OK && !taken)
			status = command_take_text("--out", "a folder", &request->directory, argc, argv, &i, &taken,
						   error);
		if (status != TW_OK)
			return status;
		if (!taken)
			return command_refuse(argv[i], (const char *const[]){"--out", NULL},
					      (const struct option_table *const[]){&table, NULL}, error);
	}
	*help = request->help;
	return request->directory || *help
		       ? TW_OK
		       : tw_fail(error, TW_ERROR_INPUT, "usage", "--out", "is missing: say --out DIR");
}

/* Fills `path`; false when it does not fit. */
static bool path_join(char path[4096], const char *directory, const char *folder, const char *name, const char *suffix)
{
	int n = snprintf(path, 4096, "%s/%s%s%s", directory, folder, name, suffix);
	return n > 0 && n < 4096;
}

static enum tw_status fail_file(struct tw_error *error, const char *path)
{
	return tw_fail(error, errno == ENOSPC ? TW_ERROR_FULL : TW_ERROR_IO, "file", NULL, "cannot write %s: %s", path,
		       strerror(errno));
}

static enum tw_status file_end(FILE *file, const char *path, struct tw_error *error)
{
	bool bad = ferror(file) != 0;
	bad = fclose(file) != 0 || bad;
	return bad ? fail_file(error, path) : TW_OK;
}

static enum tw_status write_obj(const char *path, const struct garment *garment, struct tw_error *error)
{
	FILE *file = fopen(path, "w");
	if (!file)
		return fail_file(error, path);
	fprintf(file, "# tightwire sample suit: millimetres, y up, +z forward, +x to the wearer's left\n");
	for (size_t v = 0; v < garment->vertex_count; v++)
		fprintf(file, "v %.4f %.4f %.4f\n", garment->position[3 * v], garment->position[3 * v + 1],
			garment->position[3 * v + 2]);
	for (size_t c = 0; c < garment->coord_count; c++)
		fprintf(file, "vt %.4f %.4f\n", garment->pattern[2 * c], garment->pattern[2 * c + 1]);
	for (size_t f = 0; f < garment->face_count; f++) {
		const uint32_t *v = garment->face_vertex + 3 * f, *c = garment->face_coord + 3 * f;
		if (f == 0 || garment->face_piece[f] != garment->face_piece[f - 1])
			fprintf(file, "g %s\n", garment->piece_name[garment->face_piece[f]]);
		fprintf(file, "f %u/%u %u/%u %u/%u\n", v[0] + 1, c[0] + 1, v[1] + 1, c[1] + 1, v[2] + 1, c[2] + 1);
	}
	return file_end(file, path, error);
}

static void put_u32(unsigned char *bytes, uint32_t value)
{
	for (int i = 0; i < 4; i++)
		bytes[i] = (unsigned char)(value >> 8 * i);
}

/* Floats to little-endian bytes, in place. */
static void to_bytes(float *values, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		uint32_t bits;
		memcpy(&bits, &values[i], sizeof bits);
		put_u32((unsigned char *)&values[i], bits);
	}
}

static enum tw_status write_motion(const char *path, struct sample_rig *rig, uint32_t motion, uint32_t vertices,
				   float *position, struct tw_error *error)
{
	uint32_t frames = sample_motion_at(motion)->frame_count;
	unsigned char header[PC2_HEADER_BYTES];
	FILE *file = fopen(path, "wb");
	if (!file)
		return fail_file(error, path);
	size_t header_size = pc2_write_header(header, vertices, frames);
	fwrite(header, 1, header_size, file);
	for (uint32_t frame = 0; frame < frames && !ferror(file); frame++) {
		sample_rig_pose(rig, motion, frame, position);
		to_bytes(position, 3 * (size_t)vertices);
		fwrite(position, sizeof *position, 3 * (size_t)vertices, file);
	}
	return file_end(file, path, error);
}

static enum tw_status write_terminals(const char *path, const struct sample_terminal *terminals, uint32_t count,
				      struct tw_error *error)
{
	FILE *file = fopen(path, "w");
	if (!file)
		return fail_file(error, path);
	fprintf(file, "{\"terminals\": [\n");
	for (uint32_t i = 0; i < count; i++) {
		const struct sample_terminal *t = &terminals[i];
		fprintf(file, "  {\"name\": \"%s\", ", t->name);
		if (t->face == GARMENT_NONE)
			fprintf(file, "\"vertex\": %u}", t->vertex);
		else
			fprintf(file, "\"face\": %u, \"barycentric\": [%.6f, %.6f, %.6f]}", t->face, t->barycentric[0],
				t->barycentric[1], t->barycentric[2]);
		fprintf(file, i + 1 < count ? ",\n" : "\n");
	}
	fprintf(file, "]}\n");
	return file_end(file, path, error);
}

static enum tw_status write_motions(const struct request *request, struct arena *arena, const struct garment *garment,
				    struct tw_error *error)
{
	char path[4096];
	struct sample_rig *rig;
	enum tw_status status = sample_rig_build(&rig, arena, garment, (enum sample_size)request->size, error);
	float *position = ARENA_ARRAY(arena, 3 * (size_t)garment->vertex_count, float);
	if (status == TW_OK && !position)
		status = tw_fail_memory(error);
	for (uint32_t m = 0; m < SAMPLE_MOTIONS && status == TW_OK; m++) {
		path_join(path, request->directory, "motions/", sample_motion_at(m)->name, ".pc2");
		progress_show("motion %u of %d (%s)", m + 1, SAMPLE_MOTIONS, sample_motion_at(m)->name);
		status = write_motion(path, rig, m, garment->vertex_count, position, error);
	}
	return status;
}

static enum tw_status write_terminal_sets(const struct request *request, struct arena *arena,
					  const struct garment *garment, struct tw_error *error)
{
	char path[4096];
	enum tw_status status = TW_OK;
	for (uint32_t set = 0; set < SAMPLE_TERMINAL_SETS && status == TW_OK; set++) {
		struct sample_terminal *terminals;
		uint32_t count;
		status = sample_terminals(&terminals, &count, arena, garment, (enum sample_size)request->size, set,
					  error);
		path_join(path, request->directory, "terminals/", sample_terminal_set_name(set), ".json");
		if (status == TW_OK)
			status = write_terminals(path, terminals, count, error);
	}
	return status;
}

static enum tw_status folders_make(const struct request *request, struct tw_error *error)
{
	static const char *const folders[] = {"", "motions", "terminals"};
	char path[4096];
	enum tw_status status = TW_OK;
	for (size_t i = 0; i < sizeof folders / sizeof *folders && status == TW_OK; i++) {
		/* The longest name that follows is shorter than 64 bytes. */
		if (!path_join(path, request->directory, folders[i], "", "") || strlen(path) > sizeof path - 64)
			return tw_fail(error, TW_ERROR_INPUT, "file", NULL, "the path of --out is too long");
		status = file_prepare_folder(path, error);
	}
	return status;
}

static void print_result(const struct request *request, const struct garment *garment)
{
	if (!request->json) {
		printf("%s: size %s, %u vertices, %u faces, %u pieces, %d motions, %d terminal sets\n",
		       request->directory, size_names[request->size], garment->vertex_count, garment->face_count,
		       garment->piece_count, SAMPLE_MOTIONS, SAMPLE_TERMINAL_SETS);
		return;
	}
	json_t *out = json_pack("{s:s, s:s, s:I, s:I, s:I, s:i, s:i}", "out", request->directory, "size",
				size_names[request->size], "vertices", (json_int_t)garment->vertex_count, "faces",
				(json_int_t)garment->face_count, "pieces", (json_int_t)garment->piece_count, "motions",
				SAMPLE_MOTIONS, "terminal_sets", SAMPLE_TERMINAL_SETS);
	if (out) {
		json_dumpf(out, stdout, 0);
		putchar('\n');
	}
	json_decref(out);
}

static enum tw_status write_all(const struct request *request, struct arena *arena, struct tw_error *error)
{
	char path[4096];
	struct garment garment;
	enum tw_status status = folders_make(request, error);
	progress_show("a suit of about %u vertices", request->vertices);
	if (status == TW_OK)
		status = sample_garment(&garment, arena, request->vertices, (enum sample_size)request->size, error);
	if (status == TW_OK && path_join(path, request->directory, "suit", "", ".obj"))
		status = write_obj(path, &garment, error);
	if (status == TW_OK)
		status = write_motions(request, arena, &garment, error);
	if (status == TW_OK)
		status = write_terminal_sets(request, arena, &garment, error);
	progress_clear();
	if (status == TW_OK)
		print_result(request, &garment);
	return status;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	struct arena *arena = arena_new(0);
	enum tw_status status = arena ? write_all(context, arena, error) : tw_fail_memory(error);
	arena_free(arena);
	return status;
}

int command_sample(int argc, char **argv)
{
	static const struct command_steps steps = {"sample", print_help, parse, run, NULL};
	struct request request = {0};
	return command_run(&steps, &request, argc, argv);
}
