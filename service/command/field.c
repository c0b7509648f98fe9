/* tightwire field: the weight field of a garment for a set of motions, without a server: arrays as files,
 * little-endian, and a field.json that says what they are. */
#include "service/command/command.h"
#include "service/command/garment_files.h"
#include "service/command/progress.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

struct settings {
	uint32_t threads;
	bool json, means, help;
	const char *out; /* borrowed from argv */
};

static const struct option rows[] = {
	{.name = "threads",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct settings, threads),
	 .maximum = 64,
	 .help = "0: as many as the machine has; never changes the answer"},
	{.name = "means",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct settings, means),
	 .help = "write the mean density of every motion, too"},
	{.name = "json",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct settings, json),
	 .help = "print field.json, with seconds, instead of a table"},
	{.name = "help", .kind = OPTION_FLAG, .offset = offsetof(struct settings, help), .help = "this text"},
};
static const struct option_table table = {rows, sizeof rows / sizeof *rows};

struct session {
	struct settings settings;
	struct garment_files files;
	struct arena *arena;
};

static void print_help(void)
{
	printf("usage: tightwire field --worn suit.obj [--pattern flat.obj] --motion a.pc2 … --out DIR [options]\n\n"
	       "Computes what every edge of a garment costs a wire, for a set of motions, and writes into DIR:\n\n"
	       "  density.f64      strain energy density of each face, MPa\n"
	       "  edge_vertex.u32  the two vertices of each edge, in the order of its weights\n"
	       "  file_vertex.u32  the file's vertex that each vertex is; the largest number for one that refinement "
	       "made\n"
	       "  mesh_vertex.u32  the vertex that each of the file's became\n"
	       "  file_face.u32    the file's face that each face is part of\n"
	       "  weight.u64       cost of each edge, times the scale; the largest number where it is forbidden\n"
	       "  coverage.f32     share of each edge's strip that fabric covers\n"
	       "  chord_weight.u64, chord_coverage.f32\n"
	       "                   the same of the flip chord across each edge, where there is one\n"
	       "  field.json       options, scale, counts, and shape of each array\n\n"
	       "Without a motion the density is zero and edges cost eta alone.\n\n");
	garment_files_print_paths_help(stdout);
	printf("  --out DIR         folder for the files; made where it is missing\n\n");
	option_print_help(&table, stdout);
	garment_files_print_options_help(stdout);
}

static enum tw_status take_argument(struct session *session, int argc, char **argv, int *index, bool *taken,
				    struct tw_error *error)
{
	struct settings *settings = &session->settings;
	enum tw_status status = command_take_text("--out", "a folder", &settings->out, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&table, settings, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = garment_files_take(&session->files, argc, argv, index, taken, error);
	return status;
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct session *session = context;
	option_defaults(&table, &session->settings);
	enum tw_status status = garment_files_init(&session->files, argc, error);
	for (int i = 1; i < argc && status == TW_OK; i++) {
		bool taken = false;
		status = take_argument(session, argc, argv, &i, &taken, error);
		if (status == TW_OK && !taken)
			status = command_refuse(
				argv[i], (const char *const[]){"--out", GARMENT_FILES_TEXTS, NULL},
				(const struct option_table *const[]){&table, GARMENT_FILES_TABLES, NULL}, error);
	}
	*help = session->settings.help;
	if (status == TW_OK && !*help && (!session->files.worn || !session->settings.out))
		status = tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "--worn and --out are needed; see --help");
	return status;
}

/* DIR/NAME.f64 and its row in the JSON's "arrays". */
static enum tw_status write_array(const struct session *session, const struct tw_array *array, json_t *list,
				  struct tw_error *error)
{
	static const char *const types[] = {"f32", "f64", "u8", "u32", "u64"};
	char *path, *file;
	if (asprintf(&file, "%s.%s", array->name, types[array->type]) < 0)
		return tw_fail_memory(error);
	if (asprintf(&path, "%s/%s", session->settings.out, file) < 0) {
		free(file);
		return tw_fail_memory(error);
	}
	size_t size = (size_t)array->rows * array->columns * tw_type_size(array->type);
	enum tw_status status = file_write(path, array->data, size, error);
	json_t *row =
		json_pack("{s:s, s:s, s:s, s:I, s:I}", "name", array->name, "file", file, "type", types[array->type],
			  "rows", (json_int_t)array->rows, "columns", (json_int_t)array->columns);
	if (status == TW_OK && json_array_append_new(list, row))
		status = tw_fail_memory(error);
	free(path);
	free(file);
	return status;
}

static enum tw_status write_means(const struct session *session, json_t *list, struct tw_error *error)
{
	const struct garment_files *files = &session->files;
	enum tw_status status = TW_OK;
	for (uint32_t m = 0; m < files->motion_count && status == TW_OK; m++) {
		char *name;
		if (asprintf(&name, "mean_%u_%s", m, files->motion_name[m]) < 0)
			return tw_fail_memory(error);
		struct tw_array array = {name, TW_F64, 1, files->garment.face_count, files->mean[m]};
		status = write_array(session, &array, list, error);
		free(name);
	}
	return status;
}

/* Of the arrays that the service keeps with a mesh those without which a field cannot be read: its edges, and the
 * numbers of the file. */
static enum tw_status write_mesh_arrays(const struct session *session, json_t *list, struct tw_error *error)
{
	static const char *const names[] = {"edge_vertex", "file_vertex", "mesh_vertex", "file_face"};
	const struct garment_files *files = &session->files;
	struct tw_array arrays[GARMENT_ARRAYS];
	size_t count = 0;
	enum tw_status status =
		garment_to_arrays(&files->garment, &files->topology, session->arena, arrays, &count, error);
	for (size_t i = 0; i < count && status == TW_OK; i++)
		for (size_t n = 0; n < sizeof names / sizeof *names && status == TW_OK; n++)
			if (!strcmp(arrays[i].name, names[n]))
				status = write_array(session, &arrays[i], list, error);
	return status;
}

static enum tw_status write_arrays(const struct session *session, json_t *list, struct tw_error *error)
{
	const struct garment_files *files = &session->files;
	struct tw_array arrays[FIELD_ARRAYS];
	const size_t count = field_to_arrays(&files->field, arrays);
	enum tw_status status = write_mesh_arrays(session, list, error);
	for (size_t i = 0; i < count && status == TW_OK; i++)
		if (strcmp(arrays[i].name, "scale") != 0) /* a single number stands in the JSON */
			status = write_array(session, &arrays[i], list, error);
	if (status == TW_OK && session->settings.means)
		status = write_means(session, list, error);
	return status;
}

static json_t *show_motions(const struct garment_files *files)
{
	json_t *motions = json_array();
	for (uint32_t m = 0; m < files->motion_count; m++)
		json_array_append_new(motions, json_string(files->motion_name[m]));
	return motions;
}

/* Of a new reference to `arrays`. */
static json_t *show_field(const struct session *session, json_t *arrays)
{
	const struct garment_files *files = &session->files;
	const struct field *field = &files->field;
	json_int_t forbidden = 0;
	for (uint32_t e = 0; e < field->edge_count; e++)
		forbidden += field->weight[e] == FIELD_FORBIDDEN;
	return json_pack("{s:i, s:I, s:I, s:I, s:I, s:o, s:I, s:f, s:o, s:o, s:o}", "version", 1, "vertices",
			 (json_int_t)files->garment.vertex_count, "faces", (json_int_t)field->face_count, "edges",
			 (json_int_t)field->edge_count, "forbidden_edges", forbidden, "motions", show_motions(files),
			 "frames", (json_int_t)files->frame_count, "scale", field->scale, "options",
			 option_to_json(&field_option_table, &field->options), "preset_changes",
			 field_options_changes(&field->options), "arrays", arrays);
}

static enum tw_status write_json(const struct session *session, const json_t *json, struct tw_error *error)
{
	char *path;
	char *text = json ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
	if (!text || asprintf(&path, "%s/field.json", session->settings.out) < 0) {
		free(text);
		return tw_fail_memory(error);
	}
	enum tw_status status = file_write(path, text, strlen(text), error);
	free(path);
	free(text);
	return status;
}

static int compare_numbers(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static enum tw_status print_table(const struct session *session, struct tw_error *error)
{
	const struct garment_files *files = &session->files;
	uint32_t faces = files->field.face_count;
	double *sorted = ARENA_ARRAY(session->arena, faces, double);
	if (!sorted)
		return tw_fail_memory(error);
	memcpy(sorted, files->field.density, faces * sizeof *sorted);
	qsort(sorted, faces, sizeof *sorted, compare_numbers);
	printf("%u vertices, %u faces, %u edges; %u motion%s, %u frames\n", files->garment.vertex_count, faces,
	       files->field.edge_count, files->motion_count, files->motion_count == 1 ? "" : "s", files->frame_count);
	printf("density: median %.4g, 95 %% below %.4g, largest %.4g MPa\n", sorted[faces / 2],
	       sorted[faces - 1 - faces / 20], sorted[faces - 1]);
	printf("seconds: import %.3f, strain %.3f, weights %.3f\n%s/field.json\n", files->seconds_import,
	       files->seconds_strain, files->seconds_field, session->settings.out);
	return TW_OK;
}

static enum tw_status print_json(const struct session *session, json_t *json, struct tw_error *error)
{
	const struct garment_files *files = &session->files;
	json_t *seconds = json_pack("{s:f, s:f, s:f}", "import", files->seconds_import, "strain", files->seconds_strain,
				    "weights", files->seconds_field);
	if (json_object_set_new(json, "seconds", seconds) ||
	    json_dumpf(json, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9)))
		return tw_fail_memory(error);
	printf("\n");
	return TW_OK;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	struct session *session = context;
	struct garment_files *files = &session->files;
	session->arena = arena_new(0);
	if (!session->arena)
		return tw_fail_memory(error);
	enum tw_status status = file_prepare_folder(session->settings.out, error);
	if (status == TW_OK)
		status = garment_files_load(files, session->arena, error);
	if (status == TW_OK)
		status = garment_files_field(files, session->arena, garment_files_threads(session->settings.threads),
					     error);
	progress_clear();
	if (status != TW_OK)
		return status;
	struct warning_list warnings = {0};
	field_warn_of_no_motion(&files->field, &warnings);
	warnings_print(&warnings, NULL);
	json_t *arrays = json_array();
	status = write_arrays(session, arrays, error);
	json_t *json = show_field(session, arrays);
	if (status == TW_OK)
		status = write_json(session, json, error);
	if (status == TW_OK)
		status = session->settings.json ? print_json(session, json, error) : print_table(session, error);
	json_decref(json);
	return status;
}

static void clear(void *context)
{
	struct session *session = context;
	garment_files_clear(&session->files);
	arena_free(session->arena);
}

int command_field(int argc, char **argv)
{
	static const struct command_steps steps = {"field", print_help, parse, run, clear};
	struct session session = {0};
	return command_run(&steps, &session, argc, argv);
}
