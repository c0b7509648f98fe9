#include "service/command/garment_files.h"

#include "service/command/command.h"
#include "service/command/progress.h"
#include "solver/field/means.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const size_t mesh_bytes_max = (size_t)2 << 30;

double garment_files_clock(void)
{
	struct timespec time;
	clock_gettime(CLOCK_MONOTONIC, &time);
	return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

unsigned garment_files_threads(uint32_t wanted)
{
	long online = sysconf(_SC_NPROCESSORS_ONLN);
	unsigned all = online > 64 ? 64 : online > 0 ? (unsigned)online : 1;
	return wanted ? wanted : all;
}

enum tw_status garment_files_init(struct garment_files *files, int argc, struct tw_error *error)
{
	*files = (struct garment_files){0};
	option_defaults(&import_option_table, &files->import);
	option_defaults(&motion_option_table, &files->motion_options);
	field_options_defaults(&files->field_options, FIELD_PRESET_NONE);
	files->motion = calloc((size_t)argc + 1, sizeof *files->motion);
	files->field_argument = calloc((size_t)argc + 1, sizeof *files->field_argument);
	return files->motion && files->field_argument ? TW_OK : tw_fail_memory(error);
}

void garment_files_clear(struct garment_files *files)
{
	file_source_close(&files->source);
	free(files->motion);
	free(files->field_argument);
	*files = (struct garment_files){0};
}

/* The server refuses the same motion twice, too: its weight would be that of two. */
static enum tw_status take_motion(struct garment_files *files, int argc, char **argv, int *index, bool *taken,
				  struct tw_error *error)
{
	const char **motion = &files->motion[files->motion_count];
	enum tw_status status = command_take_text("--motion", "a file", motion, argc, argv, index, taken, error);
	if (status != TW_OK || !*taken)
		return status;
	for (uint32_t m = 0; m < files->motion_count; m++)
		if (!strcmp(files->motion[m], *motion))
			return tw_fail(error, TW_ERROR_INPUT, "motion-twice", "--motion",
				       "%.160s is given twice; leave one out", *motion);
	files->motion_count++;
	return TW_OK;
}

/* A preset gives other defaults, whether it stands before the options that it changes or behind them: all arguments so
 * far are read anew over those of the preset. */
static enum tw_status take_field_option(struct garment_files *files, int argc, char **argv, int *index, bool *taken,
					struct tw_error *error)
{
	int first = *index;
	enum tw_status status =
		option_from_arguments(&field_option_table, &files->field_options, argc, argv, index, taken, error);
	for (int a = first; *taken && a <= *index && a < argc; a++)
		files->field_argument[files->field_arguments++] = argv[a];
	if (*taken)
		field_options_defaults(&files->field_options, (enum field_preset)files->field_options.preset);
	for (int a = 0; status == TW_OK && a < files->field_arguments; a++) {
		bool again = false;
		status = option_from_arguments(&field_option_table, &files->field_options, files->field_arguments,
					       files->field_argument, &a, &again, error);
	}
	return status;
}

enum tw_status garment_files_take(struct garment_files *files, int argc, char **argv, int *index, bool *taken,
				  struct tw_error *error)
{
	enum tw_status status = command_take_text("--worn", "a file", &files->worn, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = command_take_text("--pattern", "a file", &files->pattern, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = take_motion(files, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&import_option_table, &files->import, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&motion_option_table, &files->motion_options, argc, argv, index, taken,
					       error);
	return status || *taken ? status : take_field_option(files, argc, argv, index, taken, error);
}

void garment_files_print_paths_help(FILE *out)
{
	fprintf(out, "  --worn FILE       the garment as worn: OBJ (with its flat pattern as vt), PLY, OFF, STL\n"
		     "  --pattern FILE    the flat pattern, where it is a file of its own, with the same faces\n"
		     "  --motion FILE     point cache of the worn garment: PC2, MDD, OBJ sequence in a tar, or packed; "
		     "may be\n"
		     "                    repeated\n");
}

void garment_files_print_options_help(FILE *out)
{
	fprintf(out, "\nGarment:\n");
	option_print_help(&import_option_table, out);
	fprintf(out, "\nMotions (frames: what the service would keep, and the elongation is taken from):\n");
	option_print_help(&motion_option_table, out);
	fprintf(out, "\nField:\n");
	option_print_help(&field_option_table, out);
}

void warnings_print(const struct warning_list *warnings, const char *what)
{
	for (uint32_t i = 0; i < warnings->count; i++) {
		const struct warning *warning = &warnings->warning[i];
		progress_clear();
		fprintf(stderr, "warning: %s%s%s", what ? what : "", what ? ": " : "", warning->text);
		for (uint32_t k = 0; k < warning->place_count; k++)
			fprintf(stderr, k ? ", %s%u" : " (%s %u", k ? "" : warning->place_kind, warning->place[k]);
		if (warning->count > warning->place_count && warning->place_count > 0)
			fprintf(stderr, ", …; %llu in all", (unsigned long long)warning->count);
		fprintf(stderr, "%s\n", warning->place_count ? ")" : "");
	}
}

/* What is wrong with a garment, blamed on the file of the two that it is in: the import says "pattern, line 1". */
static enum tw_status blame_garment(const struct garment_files *files, enum tw_status status, struct tw_error *error)
{
	static const char word[] = "pattern";
	const size_t length = sizeof word - 1;
	const char *rest = error->where + length;
	if (status == TW_OK || !files->pattern || strncmp(error->where, word, length) != 0 ||
	    (*rest && strncmp(rest, ", ", 2) != 0))
		return file_blame(status, files->worn, error);
	rest += *rest ? 2 : 0;
	memmove(error->where, rest, strlen(rest) + 1);
	return file_blame(status, files->pattern, error);
}

enum tw_status garment_files_load(struct garment_files *files, struct arena *arena, struct tw_error *error)
{
	const char *path[2] = {files->worn, files->pattern};
	char *bytes[2] = {NULL, NULL};
	struct garment_source source[2];
	enum tw_status status = TW_OK;
	double start = garment_files_clock();
	for (int i = 0; i < 2 && path[i] && status == TW_OK; i++) {
		size_t size;
		progress_show("reading %s", path[i]);
		status = file_read(path[i], mesh_bytes_max, &bytes[i], &size, error);
		source[i] = (struct garment_source){
			.bytes = bytes[i], .size = size, .format = mesh_format_of_name(path[i]), .name = path[i]};
	}
	progress_show("checking %s", files->worn);
	if (status == TW_OK)
		status = blame_garment(files,
				       garment_import(&files->garment, arena, &source[0], path[1] ? &source[1] : NULL,
						      &files->import, &files->report, error),
				       error);
	if (status == TW_OK)
		warnings_print(&files->report.warnings, path[0]);
	if (status == TW_OK)
		status = topology_build(&files->topology, arena, &files->garment, error);
	free(bytes[0]);
	free(bytes[1]);
	files->seconds_import = garment_files_clock() - start;
	return status;
}

static enum tw_status open_as_it_came(struct garment_files *files, uint32_t motion, struct motion_reader **reader,
				      struct tw_error *error)
{
	const char *path = files->motion[motion];
	struct byte_source source;
	file_source_close(&files->source);
	enum tw_status status = file_source_open(&files->source, &source, path, error);
	if (status != TW_OK)
		return status;
	enum length_unit unit = motion_unit(&files->motion_options, (enum length_unit)files->import.unit);
	status = motion_open(reader, &source, MOTION_SNIFF, unit, garment_source_count(&files->garment), error);
	return file_blame(status, path, error);
}

enum tw_status garment_files_open_motion(struct garment_files *files, uint32_t motion, struct motion_reader **reader,
					 struct tw_error *error)
{
	if (files->motion_options.frames == FRAMES_NONE)
		return tw_fail(error, TW_ERROR_INPUT, "motion-without-frames", files->motion[motion],
			       "with --frames none only the strain against the pattern is known");
	enum tw_status status = open_as_it_came(files, motion, reader, error);
	if (status == TW_OK && files->motion_options.frames == FRAMES_PACKED)
		motion_round(*reader);
	return status;
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

/* A motion that is being read. */
struct reading {
	const struct garment_files *files;
	const struct motion_reader *reader;
	uint32_t motion;
};

static int show_frames(void *context, uint32_t frames_done)
{
	const struct reading *reading = context;
	const struct garment_files *files = reading->files;
	progress_show("strain: motion %u of %u (%s), frame %u of %u", reading->motion + 1, files->motion_count,
		      files->motion_name[reading->motion], frames_done, motion_info(reading->reader)->frame_count);
	return 0;
}

/* The strain against the pattern is taken when a motion comes in, all else from what is kept of it. */
static enum tw_status read_motion(struct garment_files *files, struct arena *arena, uint32_t motion,
				  struct tw_error *error)
{
	double *means[STRAIN_MODELS] = {0};
	double *mean = ARENA_ARRAY(arena, files->garment.face_count, double);
	files->mean[motion] = mean;
	files->motion_name[motion] = name_of(arena, files->motion[motion]);
	if (!mean || !files->motion_name[motion])
		return tw_fail_memory(error);
	means[files->field_options.energy] = mean;
	struct motion_reader *reader = NULL;
	struct means_report report = {0};
	enum tw_status status = files->field_options.reference == FIELD_REFERENCE_PATTERN
					? open_as_it_came(files, motion, &reader, error)
					: garment_files_open_motion(files, motion, &reader, error);
	struct reading reading = {files, reader, motion};
	if (status == TW_OK)
		status = file_blame(means_of_motion(means, &report, arena, &files->garment, reader,
						    &files->field_options, show_frames, &reading, error),
				    files->motion[motion], error);
	motion_close(reader);
	files->frame_count += report.frame_count;
	if (status == TW_OK)
		warnings_print(&report.warnings, files->motion[motion]);
	return status;
}

enum tw_status garment_files_field(struct garment_files *files, struct arena *arena, unsigned threads,
				   struct tw_error *error)
{
	double start = garment_files_clock();
	files->mean = arena_array(arena, files->motion_count, sizeof *files->mean);
	files->motion_name = arena_array(arena, files->motion_count, sizeof *files->motion_name);
	if (!files->mean || !files->motion_name)
		return tw_fail_memory(error);
	for (uint32_t m = 0; m < files->motion_count; m++) {
		enum tw_status status = read_motion(files, arena, m, error);
		if (status != TW_OK)
			return status;
	}
	double computed = garment_files_clock();
	files->seconds_strain = computed - start;
	progress_show("weights of %u edges", files->topology.edge_count);
	enum tw_status status = field_compute(&files->field, arena, &files->garment, &files->topology, files->mean,
					      files->motion_count, &files->field_options, threads, error);
	if (status == TW_OK)
		status = field_weigh_chords(&files->field, arena, &files->garment, &files->topology, NULL, threads,
					    NULL, error);
	files->seconds_field = garment_files_clock() - computed;
	return status;
}
