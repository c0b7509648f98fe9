#include "api/recording.h"

static const struct option rows[] = {
	{"duration_s", OPTION_NUMBER, offsetof(struct recording_options, duration_s), "s", 10, 0.1, 86400, NULL,
	 "how long to record, from the moment the rig takes the job"},
	{"tolerance", OPTION_NUMBER, offsetof(struct recording_options, tolerance), NULL, 0.02, 0, 1, NULL,
	 "share of its samples that may be missing; a recording that misses more ends as incomplete"},
};

const struct option_table recording_option_table = {rows, sizeof rows / sizeof *rows};
