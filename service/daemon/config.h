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
	char host_names[CONFIG_TEXT_SIZE];  /* with commas; "" for none */
	char log_level[CONFIG_TEXT_SIZE];
	int64_t workers;
	int64_t interactive_workers; /* of these */
	int64_t worker_threads;
	int64_t worker_memory_mib;
	int64_t lease_s;
	int64_t http_threads;
	int64_t connections;
	int64_t connections_per_address;
	int64_t held_requests;
	int64_t idle_timeout_s;
	int64_t head_timeout_s;
	int64_t request_timeout_s;
	int64_t least_rate_bytes_s;
	int64_t upload_limit_mib;
	int64_t wait_limit_s;
	int64_t drain_s;
};

enum config_outcome { CONFIG_READY, CONFIG_HELP };

/* Reads flags, environment and the file that --config or TIGHTWIRE_CONFIG names. Errors name the flag, the variable or
 * the file's line. CONFIG_HELP: --help was among the flags. */
enum tw_status config_read(struct config *config, int argc, char **argv, enum config_outcome *outcome,
			   struct tw_error *error) TW_NODISCARD;

/* Reads all of it again, and takes over what can change while the service runs. `kept` gets the names, with commas, of
 * settings that have changed and wait for a restart; "" for none. After an error *config is as it was. */
#define CONFIG_KEPT_SIZE 512
enum tw_status config_reload(struct config *config, int argc, char **argv, char kept[CONFIG_KEPT_SIZE],
			     struct tw_error *error) TW_NODISCARD;

/* The table as text for --help. */
void config_print_help(FILE *out);

#endif
