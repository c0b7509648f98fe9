#include "api/recording.h"

static const struct option rows[] = {
	{"duration_s", OPTION_NUMBER, offsetof(struct recording_options, duration_s), "s", 10, 0.1, 86400, NULL,
	 "how long to record, from the moment the rig takes the job"},
};

const struct option_table recording_option_table = {rows, sizeof rows / sizeof *rows};
