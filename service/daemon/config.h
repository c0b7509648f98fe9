/* The settings of `tightwire serve`. One table gives each its name, default, range and explanation; a flag
 * (--http-threads 4) goes before the environment (TIGHTWIRE_HTTP_THREADS=4), that before the configuration file
 * (http-threads = 4), and that before the default. */
#ifndef SERVICE_DAEMON_CONFIG_H
#define SERVICE_DAEMON_CONFIG_H

#include "tightwire.h"

#define CONFIG_TEXT_SIZE 512

struct config {
	char listen[CONFIG_TEXT_SIZE];      /* "127.0.0.1:8080", "[::1]:0" */
	char store[CONFIG_TEXT_SIZE];       /* URL of the store */
	char key_file[CONFIG_TEXT_SIZE];    /* "" for none */
	char cors_origin[CONFIG_TEXT_SIZE]; /* "" for none */
	char log_level[CONFIG_TEXT_SIZE];
	int64_t workers;
	int64_t worker_threads;
	int64_t worker_memory_mib;
	int64_t lease_s;
	int64_t http_threads;
	int64_t connections;
	int64_t idle_timeout_s;
	int64_t upload_limit_mib;
	int64_t wait_limit_s;
	int64_t drain_s;
};

enum config_outcome { CONFIG_READY, CONFIG_HELP };

/* Reads flags, environment and the file that --config or TIGHTWIRE_CONFIG names. Errors name the flag, the variable or
 * the file's line. CONFIG_HELP: --help was among the flags. */
enum tw_status config_read(struct config *config, int argc, char **argv, enum config_outcome *outcome,
			   struct tw_error *error) TW_NODISCARD;

/* The table as text for --help. */
void config_print_help(FILE *out);

#endif
