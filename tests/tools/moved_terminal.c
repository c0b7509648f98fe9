/* moved_terminal FILE MOVES HOPS: solves a Steiner instance, prepares a warm state for it, and then moves one terminal
 * after the other up to so many hops away and back; seconds of the median and of nineteen of twenty searches to stdout.
 * Exit 1 when an answer is not proven. */
#include "solver/graph/steiner_file.h"
#include "solver/splitmix.h"
#include "solver/steiner/warm/warm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOVES_MOST = 1000 };

struct walk {
	struct steiner_file file;
	struct steiner_options options;
	struct arena *arena;
	uint64_t numbers;
	uint32_t *queue; /* [vertex_count] */
	uint8_t *seen;   /* [vertex_count] */
};

static void *need(void *memory)
{
	if (!memory)
		exit(1);
	return memory;
}

static char *read_all(const char *path, size_t *size)
{
	FILE *file = need(fopen(path, "rb"));
	if (fseek(file, 0, SEEK_END))
		exit(1);
	*size = (size_t)ftell(file);
	rewind(file);
	char *bytes = need(malloc(*size + 1));
	if (fread(bytes, 1, *size, file) != *size)
		exit(1);
	fclose(file);
	return bytes;
}

/* Any of the vertices within so many hops. */
static uint32_t vertex_near(struct walk *walk, uint32_t vertex, uint32_t hops)
{
	const struct graph *graph = &walk->file.graph;
	uint32_t count = 0, next = 0;
	memset(walk->seen, 0, graph->vertex_count);
	walk->queue[count++] = vertex;
	walk->seen[vertex] = 1;
	for (uint32_t hop = 0; hop < hops; hop++)
		for (const uint32_t end = count; next < end; next++)
			for (uint32_t a = graph->first[walk->queue[next]]; a < graph->first[walk->queue[next] + 1];
			     a++) {
				const uint32_t u = graph->head[a];
				if (walk->seen[u])
					continue;
				walk->seen[u] = 1;
				walk->queue[count++] = u;
			}
	return walk->queue[splitmix(walk->numbers += SPLITMIX_STEP) % count];
}

static struct steiner_tree solve(struct walk *walk)
{
	struct steiner_tree tree;
	struct tw_error error = {0};
	if (steiner_solve(&walk->file.graph, walk->file.terminals, walk->file.terminal_count, &walk->options,
			  walk->arena, &tree, &error) != TW_OK ||
	    !tree.is_unique) {
		fprintf(stderr, "moved_terminal: no proof %s\n", error.text);
		exit(1);
	}
	return tree;
}

static double now_s(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
	struct walk walk = {.arena = need(arena_new(0)), .numbers = 1};
	struct tw_error error = {0};
	size_t size = 0;
	double seconds[MOVES_MOST];
	if (argc != 4)
		return 2;
	char *bytes = read_all(argv[1], &size);
	const uint32_t moves = (uint32_t)strtoul(argv[2], NULL, 10), hops = (uint32_t)strtoul(argv[3], NULL, 10);
	if (moves < 1 || moves > MOVES_MOST ||
	    steiner_file_read(&walk.file, walk.arena, bytes, size, &error) != TW_OK) {
		fprintf(stderr, "moved_terminal: %s %s\n", argv[1], error.text);
		return 2;
	}
	const struct graph *graph = &walk.file.graph;
	uint32_t *tie = need(ARENA_ARRAY(walk.arena, graph->edge_count, uint32_t));
	for (uint32_t e = 0; e < graph->edge_count; e++)
		tie[e] = (uint32_t)(splitmix(e * SPLITMIX_STEP) >> 32);
	walk.queue = need(ARENA_ARRAY(walk.arena, graph->vertex_count, uint32_t));
	walk.seen = need(ARENA_ARRAY(walk.arena, graph->vertex_count, uint8_t));
	walk.options = (struct steiner_options){.ties = tie, .warm = need(steiner_warm_new(0))};
	const struct steiner_tree tree = solve(&walk);
	if (steiner_warm_prepare(walk.options.warm, graph, walk.file.terminals, walk.file.terminal_count, &walk.options,
				 &tree) != TW_OK)
		return 1;
	for (uint32_t i = 0; i < moves; i++) {
		uint32_t *moved = &walk.file.terminals[i % walk.file.terminal_count];
		const uint32_t home = *moved;
		*moved = vertex_near(&walk, home, hops);
		const double started_s = now_s();
		solve(&walk);
		seconds[i] = now_s() - started_s;
		*moved = home;
	}
	qsort(seconds, moves, sizeof *seconds, compare);
	printf("%.4f %.4f\n", seconds[moves / 2], seconds[moves * 95 / 100]);
	steiner_warm_free(walk.options.warm);
	arena_free(walk.arena);
	free(bytes);
	return 0;
}
