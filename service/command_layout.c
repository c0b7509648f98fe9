/* tightwire layout: the whole computation in one process, without a server: garment, motions and terminals in, the
 * layout's files out, the same bytes as the service gives. */
#include "service/command.h"
#include "service/file.h"
#include "solver/field/field.h"
#include "solver/field/means.h"
#include "solver/garment/import.h"
#include "solver/layout/layout.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const size_t mesh_bytes_max = (size_t)2 << 30;

/* What the flags say that are no options of a stage. */
struct settings {
	uint32_t threads;
	bool json, help;
	const char *worn, *pattern, *terminals, *out; /* borrowed from argv */
	const char **motion;                          /* owned; [motion_count], each borrowed from argv */
	uint32_t motion_count;
	struct import_options import;
	struct field_options field;
	struct layout_options layout;
	const char **layout_argument; /* owned; layout options as given, to be applied over the request's own */
	uint32_t layout_arguments;
};

static const struct option own_rows[] = {
	{.name = "threads",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct settings, threads),
	 .fallback = 0,
	 .maximum = 256,
	 .help = "0: as many as the machine has; never changes the answer"},
	{.name = "json",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct settings, json),
	 .help = "print the figures as JSON"},
	{.name = "help", .kind = OPTION_FLAG, .offset = offsetof(struct settings, help), .help = "this text"},
};
static const struct option_table own_table = {own_rows, sizeof own_rows / sizeof *own_rows};

struct session {
	struct settings settings;
	struct arena *arena;
	struct garment garment;
	struct garment_report report;
	struct topology topology;
	const char **motion_name;
	const double **mean; /* [motion_count][face_count] */
	uint32_t frame_count;
	struct field field;
	struct layout_request request;
	struct layout_output output;
	struct file_source source; /* of the motion that is open */
	double seconds_import, seconds_strain, seconds_field, seconds_layout;
	bool terminal;
};

static double now(void)
{
	struct timespec time;
	clock_gettime(CLOCK_MONOTONIC, &time);
	return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void print_help(void)
{
	printf("usage: tightwire layout --worn suit.obj [--pattern flat.obj] --motion a.pc2 … --terminals t.json\n"
	       "                        --out DIR [options]\n\n"
	       "Lays the wires of least strain energy between the terminals and writes layout.json and drawings.\n\n"
	       "  --worn FILE       the garment as worn: OBJ (with its flat pattern as vt), PLY, OFF, STL\n"
	       "  --pattern FILE    the flat pattern, where it is a file of its own, with the same faces\n"
	       "  --motion FILE     point cache of the worn garment: PC2, MDD, or OBJ sequence in a tar; may be\n"
	       "                    repeated\n"
	       "  --terminals FILE  the layout request: terminals and, if wanted, options\n"
	       "  --out DIR         folder for the files; made where it is missing\n\n");
	option_print_help(&own_table, stdout);
	printf("\nGarment:\n");
	option_print_help(&import_option_table, stdout);
	printf("\nField:\n");
	option_print_help(&field_option_table, stdout);
	printf("\nLayout (over those of the request):\n");
	option_print_help(&layout_option_table, stdout);
}

/* --worn, --pattern, --terminals, --out, --motion. */
static enum tw_status take_path(struct settings *settings, int argc, char **argv, int *index, bool *taken,
				struct tw_error *error)
{
	const struct {
		const char *name;
		const char **place;
	} paths[] = {
		{"--worn", &settings->worn},
		{"--pattern", &settings->pattern},
		{"--terminals", &settings->terminals},
		{"--out", &settings->out},
		{"--motion", settings->motion ? &settings->motion[settings->motion_count] : NULL},
	};
	*taken = false;
	for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
		size_t length = strlen(paths[i].name);
		if (strncmp(argv[*index], paths[i].name, length) != 0)
			continue;
		const char *rest = argv[*index] + length;
		if (*rest && *rest != '=')
			continue;
		if (!*rest && *index + 1 >= argc)
			return tw_fail(error, TW_ERROR_INPUT, "usage", argv[*index], "needs a file");
		*paths[i].place = *rest ? rest + 1 : argv[++*index];
		settings->motion_count += i + 1 == sizeof paths / sizeof *paths;
		*taken = true;
		break;
	}
	return TW_OK;
}

static enum tw_status take_option(struct settings *settings, int argc, char **argv, int *index, bool *taken,
				  struct tw_error *error)
{
	const struct {
		const struct option_table *table;
		void *values;
	} tables[] = {
		{&own_table, settings},
		{&import_option_table, &settings->import},
		{&field_option_table, &settings->field},
		{&layout_option_table, &settings->layout},
	};
	for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
		int first = *index;
		enum tw_status status =
			option_from_arguments(tables[i].table, tables[i].values, argc, argv, index, taken, error);
		/* The request's options are not known yet: the arguments are kept and applied again over them. */
		for (int a = first; *taken && i == 3 && a <= *index; a++)
			settings->layout_argument[settings->layout_arguments++] = argv[a];
		if (status || *taken)
			return status;
	}
	return TW_OK;
}

static enum tw_status parse_arguments(struct settings *settings, int argc, char **argv, struct tw_error *error)
{
	option_defaults(&own_table, settings);
	option_defaults(&import_option_table, &settings->import);
	option_defaults(&field_option_table, &settings->field);
	option_defaults(&layout_option_table, &settings->layout);
	settings->motion = calloc((size_t)argc + 1, sizeof *settings->motion);
	settings->layout_argument = calloc((size_t)argc + 1, sizeof *settings->layout_argument);
	if (!settings->motion || !settings->layout_argument)
		return tw_fail_memory(error);
	for (int i = 1; i < argc; i++) {
		bool taken;
		enum tw_status status = take_path(settings, argc, argv, &i, &taken, error);
		if (!status && !taken)
			status = take_option(settings, argc, argv, &i, &taken, error);
		if (status)
			return status;
		if (!taken)
			return tw_fail(error, TW_ERROR_INPUT, "usage", argv[i], "no such option; see --help");
	}
	if (settings->help)
		return TW_OK;
	if (!settings->worn || !settings->terminals || !settings->out)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "--worn, --terminals and --out are needed; see --help");
	return TW_OK;
}

/* Puts the path before an error's place, so that the one line says which file it is about. */
static enum tw_status in_file(enum tw_status status, const char *path, struct tw_error *error)
{
	if (status && strcmp(error->where, path) != 0) {
		char where[sizeof error->where];
		snprintf(where, sizeof where, "%.60s%s%.60s", path, *error->where ? " " : "", error->where);
		memcpy(error->where, where, sizeof where);
	}
	return status;
}

static enum tw_status load_garment(struct session *session, struct tw_error *error)
{
	const struct settings *settings = &session->settings;
	const char *path[2] = {settings->worn, settings->pattern};
	char *bytes[2] = {NULL, NULL};
	struct garment_source source[2];
	enum tw_status status = TW_OK;
	for (int i = 0; i < 2 && path[i] && !status; i++) {
		size_t size;
		status = file_read(path[i], mesh_bytes_max, &bytes[i], &size, error);
		source[i] = (struct garment_source){
			.bytes = bytes[i], .size = size, .format = mesh_format_of_name(path[i]), .name = path[i]};
	}
	if (!status)
		status =
			in_file(garment_import(&session->garment, session->arena, &source[0],
					       path[1] ? &source[1] : NULL, &settings->import, &session->report, error),
				path[0], error);
	if (!status)
		status = topology_build(&session->topology, session->arena, &session->garment, error);
	free(bytes[0]);
	free(bytes[1]);
	return status;
}

static enum tw_status open_motion(void *context, uint32_t motion, struct motion_reader **reader, struct tw_error *error)
{
	struct session *session = context;
	const char *path = session->settings.motion[motion];
	struct byte_source source;
	file_source_close(&session->source);
	enum tw_status status = file_source_open(&session->source, &source, path, error);
	if (status)
		return status;
	enum length_unit unit = (enum length_unit)session->settings.import.unit;
	return in_file(motion_open(reader, &source, MOTION_SNIFF, unit, garment_source_count(&session->garment), error),
		       path, error);
}

/* "walk" of "motions/walk.pc2". */
static const char *name_of(struct arena *arena, const char *path)
{
	const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
	const char *dot = strrchr(base, '.');
	size_t length = dot && dot > base ? (size_t)(dot - base) : strlen(base);
	char *name = arena_array(arena, length + 1, 1);
	if (name) {
		memcpy(name, base, length);
		name[length] = 0;
	}
	return name;
}

static enum tw_status read_motion(struct session *session, uint32_t motion, struct tw_error *error)
{
	double *mean = ARENA_ARRAY(session->arena, session->garment.face_count, double);
	double *means[STRAIN_MODELS] = {0};
	session->mean[motion] = mean;
	session->motion_name[motion] = name_of(session->arena, session->settings.motion[motion]);
	if (!mean || !session->motion_name[motion])
		return tw_fail_memory(error);
	means[session->settings.field.energy] = mean;
	struct motion_reader *reader = NULL;
	uint32_t frames = 0;
	enum tw_status status = open_motion(session, motion, &reader, error);
	if (!status)
		status = in_file(means_of_motion(means, &frames, session->arena, &session->garment, reader,
						 &session->settings.field, NULL, NULL, error),
				 session->settings.motion[motion], error);
	motion_close(reader);
	session->frame_count += frames;
	return status;
}

static unsigned thread_count(const struct settings *settings)
{
	long online = sysconf(_SC_NPROCESSORS_ONLN);
	unsigned all = online > 64 ? 64 : online > 0 ? (unsigned)online : 1;
	return settings->threads ? settings->threads : all;
}

static enum tw_status make_field(struct session *session, struct tw_error *error)
{
	struct settings *settings = &session->settings;
	double start = now();
	field_options_resolve(&settings->field);
	session->mean = arena_array(session->arena, settings->motion_count, sizeof *session->mean);
	session->motion_name = arena_array(session->arena, settings->motion_count, sizeof *session->motion_name);
	if (!session->mean || !session->motion_name)
		return tw_fail_memory(error);
	for (uint32_t m = 0; m < settings->motion_count; m++) {
		enum tw_status status = read_motion(session, m, error);
		if (status)
			return status;
	}
	session->seconds_strain = now() - start;
	start = now();
	enum tw_status status =
		field_compute(&session->field, session->arena, &session->garment, &session->topology, session->mean,
			      settings->motion_count, &settings->field, thread_count(settings), error);
	session->seconds_field = now() - start;
	return status;
}

static enum tw_status load_request(struct session *session, struct tw_error *error)
{
	const struct settings *settings = &session->settings;
	char *bytes;
	size_t size;
	enum tw_status status = file_read(settings->terminals, TW_LIMIT_JSON_BYTES, &bytes, &size, error);
	if (status)
		return status;
	status = in_file(layout_request_parse(&session->request, bytes, size, error), settings->terminals, error);
	free(bytes);
	for (int i = 0; !status && i < (int)settings->layout_arguments; i++) {
		bool taken;
		status = option_from_arguments(&layout_option_table, &session->request.options,
					       (int)settings->layout_arguments,
					       (char *const *)settings->layout_argument, &i, &taken, error);
	}
	return status;
}

static void show_progress(void *context, const struct layout_progress *progress)
{
	const struct session *session = context;
	if (!session->terminal)
		return;
	fprintf(stderr, "\r\033[K%3.0f %% %s", 100 * progress->share, progress->stage);
	if (progress->weight != UINT64_MAX && progress->weight > 0)
		fprintf(stderr, ", gap %.3f %%",
			100 * (double)(progress->weight - progress->lower_bound) / (double)progress->weight);
	fflush(stderr);
}

static enum tw_status write_files(const struct session *session, struct tw_error *error)
{
	enum tw_status status = file_make_folder(session->settings.out, error);
	for (uint32_t i = 0; i < session->output.artifact_count && !status; i++) {
		const struct layout_artifact *artifact = &session->output.artifacts[i];
		char *path;
		if (asprintf(&path, "%s/%s", session->settings.out, artifact->name) < 0)
			return tw_fail_memory(error);
		status = file_write(path, artifact->bytes, artifact->size, error);
		free(path);
	}
	return status;
}

static enum tw_status compute(struct session *session, struct tw_error *error)
{
	double start = now();
	enum tw_status status = load_garment(session, error);
	session->seconds_import = now() - start;
	if (!status)
		status = load_request(session, error);
	if (!status)
		status = make_field(session, error);
	if (status)
		return status;
	struct layout_input input = {
		.garment = &session->garment,
		.topology = &session->topology,
		.field = &session->field,
		.request = &session->request,
		.motion_name = session->motion_name,
		.motion_count = session->settings.motion_count,
		.threads = thread_count(&session->settings),
		.motion_open = open_motion,
		.progress = show_progress,
		.context = session,
	};
	start = now();
	status = in_file(layout_compute(&input, session->arena, &session->output, error), session->settings.terminals,
			 error);
	session->seconds_layout = now() - start;
	if (session->terminal)
		fprintf(stderr, "\r\033[K");
	return status ? status : write_files(session, error);
}

static const char *outcome_name(const struct layout_summary *summary)
{
	return summary->outcome == STEINER_OPTIMAL ? "optimal" : "limit";
}

/* null stands for what was not computed. */
static json_t *number(double value)
{
	return isfinite(value) ? json_real(value) : json_null();
}

static enum tw_status print_json(const struct session *session, struct tw_error *error)
{
	const struct layout_summary *s = &session->output.summary;
	json_t *json = json_pack("{s:s, s:I, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:I, s:I}", "outcome",
				 outcome_name(s), "terminals", (json_int_t)s->terminal_count, "weight",
				 (json_int_t)s->weight, "lower_bound", (json_int_t)s->lower_bound, "energy_mpa_mm2",
				 number(s->energy), "baseline_energy_mpa_mm2", number(s->baseline_energy),
				 "elongation_max", number(s->elongation_max), "baseline_elongation_max",
				 number(s->baseline_elongation_max), "elongation_mean", number(s->elongation_mean),
				 "baseline_elongation_mean", number(s->baseline_elongation_mean), "length_mm",
				 number(s->length_mm), "baseline_length_mm", number(s->baseline_length_mm), "junctions",
				 (json_int_t)s->junction_count, "violations", (json_int_t)s->violation_count);
	json_t *seconds = json_pack(
		"{s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f}", "import", session->seconds_import, "strain",
		session->seconds_strain, "field", session->seconds_field, "terminals", s->seconds_terminals, "tree",
		s->seconds_tree, "baseline", s->seconds_baseline, "curves", s->seconds_curves, "metrics",
		s->seconds_metrics, "elongation", s->seconds_elongation, "artifacts", s->seconds_artifacts);
	json_t *files = json_array();
	for (uint32_t i = 0; i < session->output.artifact_count; i++)
		json_array_append_new(files,
				      json_sprintf("%s/%s", session->settings.out, session->output.artifacts[i].name));
	int failed = !json || !seconds || !files;
	failed = json_object_set_new(json, "seconds", seconds) || failed;
	failed = json_object_set_new(json, "files", files) || failed;
	failed = failed || json_dumpf(json, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
	json_decref(json);
	printf("\n");
	return failed ? tw_fail_memory(error) : TW_OK;
}

static void print_row(const char *what, double ours, double baseline, const char *unit)
{
	if (!isfinite(ours))
		return;
	printf("  %-18s %12.2f", what, ours);
	if (isfinite(baseline))
		printf(" %12.2f %9.1f %%", baseline, baseline > 0 ? 100 * (1 - ours / baseline) : 0);
	printf("  %s\n", unit);
}

static void print_table(const struct session *session)
{
	const struct layout_summary *s = &session->output.summary;
	printf("%s: %u terminals, %u junctions, %u design-rule violations; weight %llu, bound %llu\n", outcome_name(s),
	       s->terminal_count, s->junction_count, s->violation_count, (unsigned long long)s->weight,
	       (unsigned long long)s->lower_bound);
	printf("  %-18s %12s %12s %11s\n", "", "ours", "baseline", "reduction");
	print_row("energy", s->energy, s->baseline_energy, "MPa·mm²");
	print_row("elongation, max", 100 * s->elongation_max, 100 * s->baseline_elongation_max, "%");
	print_row("elongation, mean", 100 * s->elongation_mean, 100 * s->baseline_elongation_mean, "%");
	print_row("length", s->length_mm, s->baseline_length_mm, "mm");
	printf("  seconds: import %.3f, strain of %u frames %.3f, field %.3f, tree %.3f, baseline %.3f, curves %.3f, "
	       "metrics %.3f, elongation %.3f, files %.3f\n",
	       session->seconds_import, session->frame_count, session->seconds_strain, session->seconds_field,
	       s->seconds_tree, s->seconds_baseline, s->seconds_curves, s->seconds_metrics, s->seconds_elongation,
	       s->seconds_artifacts);
	for (uint32_t i = 0; i < session->output.artifact_count; i++)
		printf("  %s/%s\n", session->settings.out, session->output.artifacts[i].name);
}

static enum tw_status run(struct session *session, struct tw_error *error)
{
	session->terminal = isatty(STDERR_FILENO);
	session->arena = arena_new(0);
	if (!session->arena)
		return tw_fail_memory(error);
	enum tw_status status = compute(session, error);
	if (!status && session->settings.json)
		status = print_json(session, error);
	else if (!status)
		print_table(session);
	file_source_close(&session->source);
	layout_request_clear(&session->request);
	arena_free(session->arena);
	return status;
}

int command_layout(int argc, char **argv)
{
	struct session session = {0};
	struct tw_error error = {0};
	enum tw_status status = parse_arguments(&session.settings, argc, argv, &error);
	int code = status ? COMMAND_USAGE : COMMAND_DONE;
	if (!status && session.settings.help) {
		print_help();
	} else if (!status) {
		status = run(&session, &error);
		code = status ? COMMAND_FAILED : COMMAND_DONE;
	}
	if (status)
		fprintf(stderr, "tightwire layout: %s%s%s\n", error.where, *error.where ? ": " : "", error.text);
	free(session.settings.motion);
	free(session.settings.layout_argument);
	return code;
}
