/* A subcommand of the binary: one file NAME.c, one declaration here, one row in main.c. */
#ifndef SERVICE_COMMAND_COMMAND_H
#define SERVICE_COMMAND_COMMAND_H

#include "tightwire.h"

#include <stdbool.h>

struct option_table;

enum { COMMAND_DONE = 0, COMMAND_FAILED = 1, COMMAND_USAGE = 2 };

struct command {
	const char *name;
	int (*run)(int argc, char **argv); /* argv[0] is the command's name; returns an exit code */
	const char *summary;
};

int command_sample(int argc, char **argv);
int command_layout(int argc, char **argv);
int command_field(int argc, char **argv);
int command_steiner(int argc, char **argv);
int command_certificate(int argc, char **argv);
int command_rig(int argc, char **argv);
int command_serve(int argc, char **argv);
int command_key(int argc, char **argv);
int command_tenant(int argc, char **argv);
int command_worker(int argc, char **argv);
int command_backup(int argc, char **argv);
int command_pack(int argc, char **argv);

/* --- what they share (command.c) -------------------------------------------------------------------------------- */

/* The life of a command: its arguments, --help, its work, and one line on stderr for what went wrong. */
struct command_steps {
	const char *name;
	void (*print_help)(void);
	/* Sets *help where that is asked for. An error here is one of usage. */
	enum tw_status (*parse)(void *session, int argc, char **argv, bool *help, struct tw_error *error);
	enum tw_status (*run)(void *session, struct tw_error *error);
	void (*clear)(void *session); /* called last, whatever went before; may be NULL */
};

/* Goes through the steps; returns the exit code. */
int command_run(const struct command_steps *steps, void *session, int argc, char **argv);

/* Takes "--flag VALUE" or "--flag=VALUE" at argv[*index], which then stands on the last argument used. `what` the value
 * is, for the error: "a file". */
enum tw_status command_take_text(const char *flag, const char *what, const char **value, int argc, char **argv,
				 int *index, bool *taken, struct tw_error *error) TW_NODISCARD;

/* A flag of a command without option tables. */
struct command_flag {
	const char *name;  /* with its dashes */
	const char *what;  /* the value is: "a store"; as command_take_text */
	const char **text; /* is set; NULL: it takes no value */
	bool *is_given;    /* is set; may be NULL where there is a text */
};

enum { COMMAND_FLAGS_MAX = 32 };

/* Takes all arguments: flags, --help, and at most one of the words `verbs`, whose index is *verb then (else it stays).
 * Both lists end with NULL. */
enum tw_status command_take_all(const struct command_flag *flags, const char *const *verbs, int *verb, int argc,
				char **argv, bool *help, struct tw_error *error) TW_NODISCARD;

/* The error for an argument that no one takes: a flag that is none is told which flags there are. `texts`: those that
 * command_take_text takes, with their dashes; both lists end with NULL. */
enum tw_status command_refuse(const char *argument, const char *const *texts, const struct option_table *const *tables,
			      struct tw_error *error);

#endif
