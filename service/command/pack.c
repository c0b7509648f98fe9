/* tightwire pack: a motion to about a quarter of its size, for uploads over slow lines and for keeping. */
#include "solver/motion/pack.h"
#include "service/command/command.h"
#include "service/command/file.h"
#include "service/command/progress.h"
#include "solver/option.h"

#include <errno.h>
#include <string.h>

struct settings {
	int unit;
	bool help;
	const char *motion, *out; /* borrowed from argv */
};

static const char *const units[] = {"mm", "cm", "m", NULL};

static const struct option rows[] = {
	{.name = "unit",
	 .kind = OPTION_CHOICE,
	 .offset = offsetof(struct settings, unit),
	 .choices = units,
	 .help = "length unit of the motion's positions"},
	{.name = "help", .kind = OPTION_FLAG, .offset = offsetof(struct settings, help), .help = "this text"},
};
static const struct option_table table = {rows, sizeof rows / sizeof *rows};

/* Where the packed bytes go. */
struct output {
	FILE *file;
	const char *path;
	uint64_t size;
};

static void print_help(void)
{
	printf("usage: tightwire pack MOTION --out FILE [--unit mm|cm|m]\n\n"
	       "Packs a point cache (PC2, MDD, or an OBJ sequence in a tar), frame by frame, to about a quarter of its "
	       "size.\n"
	       "No coordinate moves by more than %.4f mm. Every command and the service read the packed file like the "
	       "others;\n"
	       "its positions are in millimetres, whatever the unit was.\n\n"
	       "  --out FILE\n      the packed motion\n",
	       MOTION_PACK_ERROR_MM);
	option_print_help(&table, stdout);
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct settings *settings = context;
	option_defaults(&table, settings);
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		enum tw_status status = option_from_arguments(&table, settings, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		if (!taken)
			status = command_take_text("--out", "a file", &settings->out, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		if (taken)
			continue;
		if (argv[i][0] == '-' || settings->motion)
			return command_refuse(argv[i], (const char *const[]){"--out", NULL},
					      (const struct option_table *const[]){&table, NULL}, error);
		settings->motion = argv[i];
	}
	*help = settings->help;
	if (!*help && (!settings->motion || !settings->out))
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "a motion and --out are needed; see --help");
	return TW_OK;
}

static enum tw_status fail_output(const struct output *output, struct tw_error *error)
{
	return tw_fail(error, errno == ENOSPC || errno == EDQUOT ? TW_ERROR_FULL : TW_ERROR_IO, "file", output->path,
		       "cannot write: %s", strerror(errno));
}

static enum tw_status write_output(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	struct output *output = context;
	output->size += size;
	progress_show("packing: %llu MiB written", (unsigned long long)output->size >> 20);
	return fwrite(bytes, 1, size, output->file) == size ? TW_OK : fail_output(output, error);
}

/* What was begun and cannot be finished is removed. */
static enum tw_status pack_to_file(struct motion_reader *reader, struct output *output, uint32_t *frames,
				   struct tw_error *error)
{
	output->file = fopen(output->path, "wb");
	if (!output->file)
		return fail_output(output, error);
	enum tw_status status = motion_pack(reader, write_output, output, frames, error);
	if (fclose(output->file) != 0 && status == TW_OK)
		status = fail_output(output, error);
	if (status != TW_OK)
		remove(output->path);
	return status;
}

static enum tw_status pack(void *context, struct tw_error *error)
{
	const struct settings *settings = context;
	struct file_source file;
	struct byte_source source;
	struct motion_reader *reader = NULL;
	struct output output = {.path = settings->out};
	uint32_t frames = 0;
	enum tw_status status = file_source_open(&file, &source, settings->motion, error);
	if (status != TW_OK)
		return status;
	status = motion_open(&reader, &source, MOTION_SNIFF, (enum length_unit)settings->unit, 0, error);
	if (status == TW_OK)
		status = pack_to_file(reader, &output, &frames, error);
	if (status != TW_OK && strcmp(error->where, settings->out) != 0)
		file_blame(status, settings->motion, error);
	progress_clear();
	if (status == TW_OK)
		printf("%s: %u frames of %u vertices, %llu bytes\n", settings->out, frames,
		       motion_info(reader)->vertex_count, (unsigned long long)output.size);
	motion_close(reader);
	file_source_close(&file);
	return status;
}

int command_pack(int argc, char **argv)
{
	static const struct command_steps steps = {"pack", print_help, parse, pack, NULL};
	struct settings settings = {0};
	return command_run(&steps, &settings, argc, argv);
}
