/* What a client asks of a recording of the bench rig: POST /v1/rig/recordings, and what its job carries. */
#ifndef API_RECORDING_H
#define API_RECORDING_H

#include "solver/option.h"

struct recording_options {
	double duration_s;
	double tolerance; /* share of its samples that may be missing */
};

extern const struct option_table recording_option_table;

#endif
