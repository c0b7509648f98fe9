/* tightwire steiner: an exact Steiner tree of a PACE 2018 or SteinLib file. The tree goes to stdout; what a person
 * wants to see meanwhile goes to stderr, and only to a terminal. An interrupt (^C) ends the search like a time limit:
 * the best tree and its bound are printed. */

#include "solver/steiner/steiner.h"
#include "service/command/command.h"
#include "service/command/file.h"
#include "service/command/instance.h"
#include "service/command/progress.h"
#include "solver/option.h"
#include "solver/steiner/certificate/file.h"

#include <inttypes.h>
#include <jansson.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

struct settings {
	double time_limit, work_limit;
	uint32_t memory_limit, threads;
	bool json, stats, help;
	const char *path;        /* borrowed from argv; "-" is stdin */
	const char *certificate; /* borrowed from argv; NULL for none */
};

static const struct option rows[] = {
	{.name = "time_limit",
	 .kind = OPTION_NUMBER,
	 .offset = offsetof(struct settings, time_limit),
	 .unit = "s",
	 .maximum = 1e9,
	 .help = "stop after so long with the best tree and its proven bound; 0: when proven"},
	{.name = "work_limit",
	 .kind = OPTION_NUMBER,
	 .offset = offsetof(struct settings, work_limit),
	 .unit = "units",
	 .maximum = 1e18,
	 .help = "likewise after so much work, with the same answer on every machine; 0: none"},
	{.name = "memory_limit",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct settings, memory_limit),
	 .unit = "MiB",
	 .maximum = UINT32_MAX,
	 .help = "scratch memory; the best that fits; 0: no limit"},
	{.name = "threads",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct settings, threads),
	 .fallback = 1,
	 .minimum = 1,
	 .maximum = 256,
	 .help = "never changes the answer"},
	{.name = "json",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct settings, json),
	 .help = "print outcome, weight, bound, gap, edges and statistics as JSON"},
	{.name = "stats",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct settings, stats),
	 .help = "print statistics and seconds by stage (to stderr, or into the JSON)"},
	{.name = "help", .kind = OPTION_FLAG, .offset = offsetof(struct settings, help), .help = "this text"},
};

static const struct option_table table = {rows, sizeof rows / sizeof *rows};

static void print_help(void)
{
	printf("usage: tightwire steiner FILE.gr | FILE.stp | - [options]\n\n"
	       "Solves a Steiner tree instance (PACE 2018 or SteinLib) to a proven optimum and prints it as PACE "
	       "does:\n"
	       "`VALUE n`, then an edge `u v` a line.\n\n"
	       "  --certificate FILE\n"
	       "      write the tree with a lower bound that `tightwire certificate` checks without the solver\n");
	option_print_help(&table, stdout);
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct settings *settings = context;
	option_defaults(&table, settings);
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		enum tw_status status = option_from_arguments(&table, settings, argc, argv, &i, &taken, error);
		if (status == TW_OK && !taken)
			status = command_take_text("--certificate", "a file", &settings->certificate, argc, argv, &i,
						   &taken, error);
		if (status != TW_OK)
			return status;
		if (taken)
			continue;
		if (argv[i][0] == '-' && argv[i][1])
			return command_refuse(argv[i], (const char *const[]){"--certificate", NULL},
					      (const struct option_table *const[]){&table, NULL}, error);
		if (settings->path)
			return tw_fail(error, TW_ERROR_INPUT, "usage", argv[i], "one file at a time");
		settings->path = argv[i];
	}
	*help = settings->help;
	if (!settings->path && !*help)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "name a file, or - for stdin; see --help");
	return TW_OK;
}

static volatile sig_atomic_t interrupted;

static void on_interrupt(int number)
{
	(void)number;
	interrupted = 1;
}

static bool is_interrupted(void *context)
{
	(void)context;
	return interrupted != 0;
}

static double gap_percent(uint64_t weight, uint64_t bound)
{
	return weight && weight > bound ? 100.0 * (double)(weight - bound) / (double)weight : 0;
}

static void show_progress(void *context, const struct steiner_progress *progress)
{
	(void)context;
	if (progress->weight == UINT64_MAX)
		progress_show("%-16s no tree yet, bound %llu", progress->stage,
			      (unsigned long long)progress->lower_bound);
	else
		progress_show("%-16s weight %llu, bound %llu, gap %.3f %%", progress->stage,
			      (unsigned long long)progress->weight, (unsigned long long)progress->lower_bound,
			      gap_percent(progress->weight, progress->lower_bound));
}

static const char *outcome_name(enum steiner_outcome outcome)
{
	static const char *const names[] = {
		[STEINER_OPTIMAL] = "optimal",
		[STEINER_LIMIT] = "limit",
		[STEINER_CANCELLED] = "cancelled",
		[STEINER_INFEASIBLE] = "infeasible",
	};
	return names[outcome];
}

static json_t *seconds_json(const struct steiner_stats *stats)
{
	return json_pack("{s:f, s:f, s:f, s:f, s:f}", "reduce", stats->seconds_reduce, "dual", stats->seconds_dual,
			 "primal", stats->seconds_primal, "exact", stats->seconds_exact, "total", stats->seconds_total);
}

static json_t *stats_json(const struct steiner_stats *stats, int with_seconds)
{
	json_t *json = json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:I}", "work", (json_int_t)stats->work, "labels",
				 (json_int_t)stats->labels, "sets", (json_int_t)stats->sets, "branch_nodes",
				 (json_int_t)stats->branch_nodes, "vertices_left", (json_int_t)stats->vertices_left,
				 "edges_left", (json_int_t)stats->edges_left, "memory_peak_bytes",
				 (json_int_t)stats->memory_peak);
	if (json && with_seconds)
		json_object_set_new(json, "seconds", seconds_json(stats));
	return json;
}

static json_t *edges_json(const struct steiner_file *file, const struct steiner_tree *tree)
{
	json_t *edges = json_array();
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		const uint32_t *ends = file->graph.ends + 2 * (size_t)tree->edges[i];
		json_array_append_new(edges, json_pack("[I, I]", (json_int_t)ends[0] + 1, (json_int_t)ends[1] + 1));
	}
	return edges;
}

static enum tw_status print_json(const struct steiner_file *file, const struct steiner_tree *tree, int with_seconds,
				 struct tw_error *error)
{
	json_t *json = json_object();
	json_object_set_new(json, "outcome", json_string(outcome_name(tree->outcome)));
	if (tree->outcome == STEINER_INFEASIBLE) {
		json_object_set_new(
			json, "apart",
			json_pack("[I, I]", (json_int_t)tree->terminal_a + 1, (json_int_t)tree->terminal_b + 1));
	} else {
		json_object_set_new(json, "weight", json_sprintf("%" PRIu64, tree->weight));
		json_object_set_new(json, "lower_bound", json_sprintf("%" PRIu64, tree->lower_bound));
		json_object_set_new(json, "gap_percent", json_real(gap_percent(tree->weight, tree->lower_bound)));
		json_object_set_new(json, "reproducible", json_boolean(tree->is_reproducible));
		json_object_set_new(json, "edges", edges_json(file, tree));
	}
	json_object_set_new(json, "stats", stats_json(&tree->stats, with_seconds));
	const int failed = json_dumpf(json, stdout, JSON_COMPACT | JSON_REAL_PRECISION(12));
	json_decref(json);
	putchar('\n');
	return failed ? tw_fail(error, TW_ERROR_IO, "file-write", NULL, "the result cannot be written") : TW_OK;
}

static void print_pace(const struct steiner_file *file, const struct steiner_tree *tree)
{
	printf("VALUE %llu\n", (unsigned long long)tree->weight);
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		const uint32_t *ends = file->graph.ends + 2 * (size_t)tree->edges[i];
		printf("%u %u\n", ends[0] + 1, ends[1] + 1);
	}
}

static void print_stats(const struct steiner_stats *stats)
{
	fprintf(stderr, "work %llu, labels %llu, sets %llu, branch nodes %llu, left %u vertices %u edges, memory %zu\n",
		(unsigned long long)stats->work, (unsigned long long)stats->labels, (unsigned long long)stats->sets,
		(unsigned long long)stats->branch_nodes, stats->vertices_left, stats->edges_left, stats->memory_peak);
	fprintf(stderr, "seconds: reduce %.3f, dual %.3f, primal %.3f, exact %.3f, total %.3f\n", stats->seconds_reduce,
		stats->seconds_dual, stats->seconds_primal, stats->seconds_exact, stats->seconds_total);
}

static enum tw_status print_tree(const struct settings *settings, const struct steiner_file *file,
				 const struct steiner_tree *tree, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	if (settings->json)
		status = print_json(file, tree, settings->stats, error);
	else if (tree->outcome != STEINER_INFEASIBLE)
		print_pace(file, tree);
	if (settings->stats && !settings->json)
		print_stats(&tree->stats);
	if (status == TW_OK && (fflush(stdout) || ferror(stdout)))
		status = tw_fail(error, TW_ERROR_IO, "file-write", NULL, "the result cannot be written");
	if (status != TW_OK)
		return status;
	if (tree->outcome == STEINER_INFEASIBLE)
		return tw_fail(error, TW_ERROR_INPUT, "steiner-infeasible", NULL,
			       "no tree: the terminals %u and %u are not connected", tree->terminal_a + 1,
			       tree->terminal_b + 1);
	if (tree->outcome != STEINER_OPTIMAL && !settings->json)
		fprintf(stderr, "tightwire steiner: not proven optimal (%s): lower bound %llu, gap %.4f %%\n",
			outcome_name(tree->outcome), (unsigned long long)tree->lower_bound,
			gap_percent(tree->weight, tree->lower_bound));
	return TW_OK;
}

/* The solver knows no flags. What it would need for this instance is not known before it is tried. */
static void explain_memory(const struct settings *settings, const struct graph *graph, struct tw_error *error)
{
	if (!settings->memory_limit)
		return;
	snprintf(error->text, sizeof error->text,
		 "%u MiB, which --memory-limit allows, do not hold %u vertices and %u edges; raise it, or leave it out",
		 settings->memory_limit, graph->vertex_count, graph->edge_count);
}

static enum tw_status write_certificate(const struct settings *settings, const struct steiner_file *file,
					const struct steiner_tree *tree, struct arena *arena, struct tw_error *error)
{
	struct steiner_certificate certificate;
	const char *bytes;
	size_t length;
	enum tw_status status = steiner_certify(&file->graph, file->terminals, file->terminal_count, tree,
						(size_t)settings->memory_limit << 20, arena, &certificate, error);
	if (status == TW_ERROR_MEMORY)
		explain_memory(settings, &file->graph, error);
	if (status == TW_OK)
		status = certificate_write(&certificate, arena, &bytes, &length, error);
	return status == TW_OK ? file_write(settings->certificate, bytes, length, error) : status;
}

static enum tw_status solve_file(const struct settings *settings, struct arena *arena, struct tw_error *error)
{
	struct steiner_file file;
	enum tw_status status = instance_read(settings->path, arena, &file, error);
	if (status == TW_OK && settings->certificate)
		status = file_check_writable(settings->certificate, error);
	if (status != TW_OK)
		return status;
	const struct steiner_options solver = {
		.time_limit_s = settings->time_limit,
		.work_limit = (uint64_t)settings->work_limit,
		.memory_limit = (size_t)settings->memory_limit << 20,
		.threads = settings->threads,
		.progress = show_progress,
		.cancelled = is_interrupted,
	};
	struct sigaction interrupt = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
	sigaction(SIGINT, &interrupt, NULL);
	struct steiner_tree tree;
	status = file_blame(
		steiner_solve(&file.graph, file.terminals, file.terminal_count, &solver, arena, &tree, error),
		settings->path, error);
	progress_clear();
	if (status == TW_ERROR_MEMORY)
		explain_memory(settings, &file.graph, error);
	if (status == TW_OK)
		status = file_blame(print_tree(settings, &file, &tree, error), settings->path, error);
	if (status == TW_OK && settings->certificate)
		status = write_certificate(settings, &file, &tree, arena, error);
	return status;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	const struct settings *settings = context;
	struct arena *arena = arena_new(0);
	const enum tw_status status = arena ? solve_file(settings, arena, error) : tw_fail_memory(error);
	arena_free(arena);
	return status;
}

int command_steiner(int argc, char **argv)
{
	static const struct command_steps steps = {"steiner", print_help, parse, run, NULL};
	struct settings settings = {0};
	return command_run(&steps, &settings, argc, argv);
}
