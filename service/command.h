/* A subcommand of the binary: one file command_NAME.c, one declaration here, one row in main.c. */
#ifndef SERVICE_COMMAND_H
#define SERVICE_COMMAND_H

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
int command_worker(int argc, char **argv);
int command_backup(int argc, char **argv);
int command_pack(int argc, char **argv);

#endif
