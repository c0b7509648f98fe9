/* tightwire layout: the whole computation in one process, without a server: garment, motions and terminals in, the
 * layout's files out, the same bytes as the service gives. */
#include "solver/layout/layout.h"
#include "service/command/command.h"
#include "service/command/garment_files.h"
#include "service/command/progress.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the flags say that are no options of a stage. */
struct settings {
	uint32_t threads;
	bool json, help;
	const char *terminals, *out; /* borrowed from argv */
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
	struct garment_files files;
	struct layout_request request;
	struct layout_output output;
};

static void print_help(void)
{
	printf("usage: tightwire layout --worn suit.obj [--pattern flat.obj] --motion a.pc2 … --terminals t.json\n"
	       "                        --out DIR [options]\n\n"
	       "Lays the wires of least strain energy between the terminals and writes layout.json and drawings.\n\n");
	garment_files_print_paths_help(stdout);
	printf("  --terminals FILE  the layout request: terminals and, if wanted, options\n"
	       "  --out DIR         folder for the files; made where it is missing\n\n");
	option_print_help(&own_table, stdout);
	garment_files_print_options_help(stdout);
	printf("\nLayout (over those of the request):\n");
	option_print_help(&layout_option_table, stdout);
}

/* One argument, or two. Layout options are kept: the request's own are not known yet, and these go over them. */
static enum tw_status take_argument(struct session *session, int argc, char **argv, int *index, bool *taken,
				    struct tw_error *error)
{
	struct settings *settings = &session->settings;
	int first = *index;
	enum tw_status status =
		command_take_text("--terminals", "a file", &settings->terminals, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = command_take_text("--out", "a folder", &settings->out, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&own_table, settings, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = garment_files_take(&session->files, argc, argv, index, taken, error);
	if (status != TW_OK || *taken)
		return status;
	status = option_from_arguments(&layout_option_table, &settings->layout, argc, argv, index, taken, error);
	for (int a = first; *taken && a <= *index; a++)
		settings->layout_argument[settings->layout_arguments++] = argv[a];
	return status;
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct session *session = context;
	struct settings *settings = &session->settings;
	option_defaults(&own_table, settings);
	option_defaults(&layout_option_table, &settings->layout);
	settings->layout_argument = calloc((size_t)argc + 1, sizeof *settings->layout_argument);
	if (!settings->layout_argument || garment_files_init(&session->files, argc, error) != TW_OK)
		return tw_fail_memory(error);
	for (int i = 1; i < argc; i++) {
		bool taken;
		enum tw_status status = take_argument(session, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		if (!taken)
			return command_refuse(argv[i],
					      (const char *const[]){"--terminals", "--out", GARMENT_FILES_TEXTS, NULL},
					      (const struct option_table *const[]){&own_table, GARMENT_FILES_TABLES,
										   &layout_option_table, NULL},
					      error);
	}
	*help = settings->help;
	if (!*help && (!session->files.worn || !settings->terminals || !settings->out))
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "--worn, --terminals and --out are needed; see --help");
	return TW_OK;
}

static enum tw_status open_motion(void *context, uint32_t motion, struct motion_reader **reader, struct tw_error *error)
{
	struct session *session = context;
	return garment_files_open_motion(&session->files, motion, reader, error);
}

static enum tw_status take_mean(void *context, uint32_t motion, double *density, struct tw_error *error)
{
	const struct session *session = context;
	(void)error;
	memcpy(density, session->files.mean[motion], session->files.garment.face_count * sizeof *density);
	return TW_OK;
}

static enum tw_status load_request(struct session *session, struct tw_error *error)
{
	const struct settings *settings = &session->settings;
	char *bytes;
	size_t size;
	enum tw_status status = file_read(settings->terminals, TW_LIMIT_JSON_BYTES, &bytes, &size, error);
	if (status != TW_OK)
		return status;
	status = file_blame(layout_request_parse(&session->request, bytes, size, error), settings->terminals, error);
	free(bytes);
	for (int i = 0; status == TW_OK && i < (int)settings->layout_arguments; i++) {
		bool taken;
		status = option_from_arguments(&layout_option_table, &session->request.options,
					       (int)settings->layout_arguments,
					       (char *const *)settings->layout_argument, &i, &taken, error);
	}
	return status;
}

static void show_progress(void *context, const struct layout_progress *progress)
{
	(void)context;
	char gap[32] = "";
	if (progress->weight != UINT64_MAX)
		snprintf(gap, sizeof gap, ", gap %.3f %%", 100 * layout_gap(progress->weight, progress->lower_bound));
	progress_show("%3.0f %% %s%s", 100 * progress->share, progress->stage, gap);
}

static enum tw_status write_files(const struct session *session, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (uint32_t i = 0; i < session->output.artifact_count && status == TW_OK; i++) {
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
	const unsigned threads = garment_files_threads(session->settings.threads);
	struct garment_files *files = &session->files;
	enum tw_status status = file_prepare_folder(session->settings.out, error);
	if (status == TW_OK)
		status = garment_files_load(files, session->arena, error);
	if (status == TW_OK)
		status = load_request(session, error);
	if (status == TW_OK)
		status = garment_files_field(files, session->arena, threads, error);
	if (status != TW_OK)
		return status;
	const bool *none = ARENA_ZEROED(session->arena, files->motion_count + 1, bool);
	if (!none)
		return tw_fail_memory(error);
	struct layout_input input = {
		.garment = &files->garment,
		.topology = &files->topology,
		.field = &files->field,
		.request = &session->request,
		.motion_name = files->motion_name,
		.motion_count = files->motion_count,
		.motion_has_frames = files->motion_options.frames == FRAMES_NONE ? none : NULL,
		.threads = threads,
		.motion_open = open_motion,
		.motion_mean = take_mean,
		.progress = show_progress,
		.context = session,
	};
	status = file_blame(layout_compute(&input, session->arena, &session->output, error),
			    session->settings.terminals, error);
	progress_clear();
	if (status == TW_OK)
		status = write_files(session, error);
	if (status == TW_OK)
		warnings_print(&session->output.summary.warnings, NULL);
	return status;
}

/* The seconds of what stands before the layout. */
static int add_seconds(const struct session *session, json_t *seconds)
{
	return json_object_set_new(seconds, "import", json_real(session->files.seconds_import)) ||
	       json_object_set_new(seconds, "strain", json_real(session->files.seconds_strain)) ||
	       json_object_set_new(seconds, "field", json_real(session->files.seconds_field));
}

static int add_files(const struct session *session, json_t *json)
{
	json_t *files = json_array();
	int failed = json_object_set_new(json, "files", files);
	for (uint32_t i = 0; i < session->output.artifact_count && !failed; i++)
		failed = json_array_append_new(
			files, json_sprintf("%s/%s", session->settings.out, session->output.artifacts[i].name));
	return failed;
}

static enum tw_status print_json(const struct session *session, struct tw_error *error)
{
	json_t *json = layout_summary_show(&session->output.summary);
	int failed = add_seconds(session, json_object_get(json, "seconds")) || add_files(session, json) ||
		     json_dumpf(json, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
	json_decref(json);
	printf("\n");
	return failed ? tw_fail_memory(error) : TW_OK;
}

static void print_figure(const struct layout_figure *figure, const struct layout_summary *summary)
{
	double ours = layout_figure_of(figure, &summary->ours);
	double baseline = layout_figure_of(figure, &summary->baseline);
	if (!isfinite(ours))
		return;
	printf("  %-18s %12.2f", figure->title, ours * figure->unit_scale);
	if (isfinite(baseline))
		printf(" %12.2f", baseline * figure->unit_scale);
	else
		printf(" %12s", "-");
	if (baseline > 0)
		printf(" %9.1f %%", layout_reduction_percent(ours, baseline));
	else
		printf(" %11s", "-");
	printf("  %s\n", figure->unit);
}

static void print_table(const struct session *session)
{
	const struct layout_summary *s = &session->output.summary;
	printf("%s: %u terminals, %u junctions, %u design-rule violations; weight %llu, bound %llu\n",
	       layout_outcome_name(s->outcome), s->terminal_count, s->junction_count, s->violation_count,
	       (unsigned long long)s->weight, (unsigned long long)s->lower_bound);
	printf("  %-18s %12s %12s %11s\n", "", "ours", "baseline", "reduction");
	for (size_t i = 0; i < LAYOUT_FIGURES; i++)
		print_figure(&layout_figures[i], s);
	if (s->has_baseline && s->baseline_outcome != STEINER_OPTIMAL)
		printf("  the baseline is not proven: a tree up to %.2f %% lighter may exist\n", 100 * s->baseline_gap);
	printf("  seconds: import %.3f, strain of %u frames %.3f, field %.3f, tree %.3f, baseline %.3f, curves %.3f, "
	       "metrics %.3f, elongation %.3f, files %.3f\n",
	       session->files.seconds_import, session->files.frame_count, session->files.seconds_strain,
	       session->files.seconds_field, s->seconds_tree, s->seconds_baseline, s->seconds_curves,
	       s->seconds_metrics, s->seconds_elongation, s->seconds_artifacts);
	for (uint32_t i = 0; i < session->output.artifact_count; i++)
		printf("  %s/%s\n", session->settings.out, session->output.artifacts[i].name);
}

static enum tw_status run(void *context, struct tw_error *error)
{
	struct session *session = context;
	session->arena = arena_new(0);
	if (!session->arena)
		return tw_fail_memory(error);
	enum tw_status status = compute(session, error);
	if (status == TW_OK && session->settings.json)
		status = print_json(session, error);
	else if (status == TW_OK)
		print_table(session);
	return status;
}

static void clear(void *context)
{
	struct session *session = context;
	layout_request_clear(&session->request);
	garment_files_clear(&session->files);
	free(session->settings.layout_argument);
	arena_free(session->arena);
}

int command_layout(int argc, char **argv)
{
	static const struct command_steps steps = {"layout", print_help, parse, run, clear};
	struct session session = {0};
	return command_run(&steps, &session, argc, argv);
}
