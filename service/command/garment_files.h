/* A garment and its motions from files, as the commands take them that work without a store: arguments in, garment,
 * strain and field out. */
#ifndef SERVICE_COMMAND_GARMENT_FILES_H
#define SERVICE_COMMAND_GARMENT_FILES_H

#include "service/command/file.h"
#include "solver/field/field.h"
#include "solver/garment/import.h"
#include "solver/motion/options.h"

#include <stdbool.h>

struct garment_files {
	/* From the arguments. */
	const char *worn, *pattern; /* borrowed from argv; NULL where not given */
	const char **motion;        /* owned; [motion_count], each borrowed from argv */
	uint32_t motion_count;
	struct import_options import;
	struct motion_options motion_options;
	struct field_options field_options;
	char **field_argument; /* owned; the options of the field as given, each borrowed from argv */
	int field_arguments;

	/* From the files; in the arena that they are loaded with. */
	struct garment garment;
	struct garment_report report;
	struct topology topology;
	const char **motion_name; /* [motion_count] "walk" of "motions/walk.pc2" */
	const double **mean;      /* [motion_count][face_count] of the energy model that the options name */
	uint32_t frame_count;     /* of all motions */
	struct field field;
	double seconds_import, seconds_strain, seconds_field;

	struct file_source source; /* of the motion that is open */
};

/* Defaults, and room for the motions that `argc` arguments can name. TW_ERROR_MEMORY. */
enum tw_status garment_files_init(struct garment_files *files, int argc, struct tw_error *error) TW_NODISCARD;
void garment_files_clear(struct garment_files *files);

/* Takes argv[*index] if it is --worn, --pattern, --motion, or an option of the import or the field; *index then stands
 * on the last argument used. */
enum tw_status garment_files_take(struct garment_files *files, int argc, char **argv, int *index, bool *taken,
				  struct tw_error *error) TW_NODISCARD;

/* For command_refuse: the flags that garment_files_take takes. */
#define GARMENT_FILES_TEXTS "--worn", "--pattern", "--motion"
#define GARMENT_FILES_TABLES &import_option_table, &motion_option_table, &field_option_table

/* The help of these arguments. */
void garment_files_print_paths_help(FILE *out);
void garment_files_print_options_help(FILE *out);

/* Reads the garment; then, from all motions, the field. Errors begin with the file's path. */
enum tw_status garment_files_load(struct garment_files *files, struct arena *arena,
				  struct tw_error *error) TW_NODISCARD;
enum tw_status garment_files_field(struct garment_files *files, struct arena *arena, unsigned threads,
				   struct tw_error *error) TW_NODISCARD;

/* Opens a motion as the service would have kept it, rounded to what packing leaves; TW_ERROR_INPUT
 * "motion-without-frames" where that is nothing. The motion before is closed. The reader is the caller's. */
enum tw_status garment_files_open_motion(struct garment_files *files, uint32_t motion, struct motion_reader **reader,
					 struct tw_error *error) TW_NODISCARD;

/* One line each on stderr: "warning: suit.obj: … (vertex 3, 4, …; 12 in all)", as the service shows them. `what`
 * is the file to blame; NULL: none. */
void warnings_print(const struct warning_list *warnings, const char *what);

/* Threads for `wanted`; 0: as many as the machine has. */
unsigned garment_files_threads(uint32_t wanted);

/* Seconds of a clock that only goes forward. */
double garment_files_clock(void);

#endif
