/* solve_pictures FOLDER: draws one solve, stage by stage, for solver/steiner/README.md: balls.svg, flow.svg, left.svg
 * and tree.svg. The stages are the solver's own, on a flat sheet of fabric with some places that stretch. */
#include "solver/drawing/svg.h"
#include "solver/steiner/flow/state.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/steiner.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 46, ROWS = 30, VERTICES = COLUMNS * ROWS, EDGES_MOST = 3 * VERTICES, TERMINALS = 14 };
enum { ITERATIONS = 24, SHADES = 5, COLOURS = 14, TURNS = 2 };
static const double spacing = 4, margin = 6;

struct sheet {
	struct arena *arena;
	struct vec2 at[VERTICES];
	uint32_t ends[2 * EDGES_MOST], edge_count;
	uint64_t weight[EDGES_MOST];
	uint32_t terminal[TERMINALS];
	struct graph graph;
};

static const struct drawing_style gone_style = {.name = "gone", .stroke = "#e3ded4", .stroke_mm = 0.25};
static const struct drawing_style mesh_style = {.name = "mesh", .stroke = "#8a8375", .stroke_mm = 0.35};
static const struct drawing_style tree_style = {.name = "tree", .stroke = "#b3261e", .stroke_mm = 1.4};
static const struct drawing_style terminal_style = {.name = "terminal", .fill = "#14532d"};
static const struct drawing_style root_style = {.name = "root", .fill = "#000000"};
static const struct drawing_style text_style = {.name = "text", .fill = "#000000"};
static const struct drawing_style flow_style[SHADES] = {
	{.name = "flow-1", .stroke = "#c9d9ea", .stroke_mm = 0.5},
	{.name = "flow-2", .stroke = "#8fb3d6", .stroke_mm = 0.8},
	{.name = "flow-3", .stroke = "#5389bd", .stroke_mm = 1.1},
	{.name = "flow-4", .stroke = "#1f6fb2", .stroke_mm = 1.5},
	{.name = "flow-5", .stroke = "#0b3d6b", .stroke_mm = 2},
};
static const struct drawing_style ball_style[COLOURS] = {
	{.name = "ball-1", .fill = "#b3261e"},  {.name = "ball-2", .fill = "#1f6fb2"},
	{.name = "ball-3", .fill = "#e8a33d"},  {.name = "ball-4", .fill = "#2e7d32"},
	{.name = "ball-5", .fill = "#7b3fa0"},  {.name = "ball-6", .fill = "#00838f"},
	{.name = "ball-7", .fill = "#c2185b"},  {.name = "ball-8", .fill = "#6d4c41"},
	{.name = "ball-9", .fill = "#9e9d24"},  {.name = "ball-10", .fill = "#455a64"},
	{.name = "ball-11", .fill = "#ef6c00"}, {.name = "ball-12", .fill = "#3949ab"},
	{.name = "ball-13", .fill = "#00695c"}, {.name = "ball-14", .fill = "#ad1457"},
};

static void must(enum tw_status status)
{
	if (status == TW_OK)
		return;
	fprintf(stderr, "solve_pictures: status %d\n", (int)status);
	exit(1);
}

static double draw_number(uint64_t *state)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (double)(*state >> 33) / 2147483648.0;
}

/* How much the fabric stretches: some places do, like an elbow. */
static double strain_at(struct vec2 at)
{
	static const double place[][3] = {{45, 30, 18}, {120, 80, 22}, {95, 25, 14}, {40, 90, 20}, {155, 40, 16}};
	double strain = 0.15;
	for (size_t i = 0; i < sizeof place / sizeof *place; i++) {
		const double x = (at.x - place[i][0]) / place[i][2], y = (at.y - place[i][1]) / place[i][2];
		strain += exp(-x * x - y * y);
	}
	return strain;
}

static void add_edge(struct sheet *sheet, uint32_t u, uint32_t v)
{
	const struct vec2 a = sheet->at[u], b = sheet->at[v], middle = {(a.x + b.x) / 2, (a.y + b.y) / 2};
	const uint32_t e = sheet->edge_count++;
	sheet->ends[2 * e] = u;
	sheet->ends[2 * e + 1] = v;
	sheet->weight[e] = (uint64_t)(1000 * hypot(a.x - b.x, a.y - b.y) * strain_at(middle)) + 1;
}

static void make_sheet(struct sheet *sheet)
{
	uint64_t numbers = 7;
	for (uint32_t v = 0; v < VERTICES; v++) {
		const uint32_t column = v % COLUMNS, row = v / COLUMNS;
		const double x = spacing * column + 0.9 * spacing * (draw_number(&numbers) - 0.5);
		const double y = spacing * row + 0.9 * spacing * (draw_number(&numbers) - 0.5);
		sheet->at[v] = (struct vec2){margin + x, margin + y};
	}
	for (uint32_t v = 0; v < VERTICES; v++) {
		const bool has_right = v % COLUMNS + 1 < COLUMNS, has_up = v / COLUMNS + 1 < ROWS;
		if (has_right)
			add_edge(sheet, v, v + 1);
		if (has_up)
			add_edge(sheet, v, v + COLUMNS);
		if (has_right && has_up)
			add_edge(sheet, v, v + COLUMNS + 1);
	}
	/* One terminal in each of as many cells of the sheet. */
	for (uint32_t t = 0; t < TERMINALS; t++) {
		const uint32_t across = t % 5, up = t / 5;
		const uint32_t column = (uint32_t)((across + 0.15 + 0.7 * draw_number(&numbers)) * COLUMNS / 5);
		const uint32_t row = (uint32_t)((up + 0.15 + 0.7 * draw_number(&numbers)) * ROWS / 3);
		sheet->terminal[t] = row * COLUMNS + column;
	}
	must(graph_build(&sheet->graph, sheet->arena, VERTICES, sheet->edge_count, sheet->ends, sheet->weight, NULL));
}

static struct drawing new_drawing(const struct sheet *sheet, const char *title)
{
	return (struct drawing){
		.arena = sheet->arena,
		.title = title,
		.width = 2 * margin + spacing * (COLUMNS - 1),
		.height = 2 * margin + spacing * (ROWS - 1) + 8,
		.decimals = 1,
	};
}

static void add_edges(struct drawing *drawing, const struct sheet *sheet, const uint32_t *edges, uint32_t count,
		      const struct drawing_style *style)
{
	struct drawing_item *path = drawing_add_path(drawing, style, DRAWING_NONE, false);
	for (uint32_t i = 0; i < count; i++) {
		drawing_move_to(drawing, path, sheet->at[sheet->ends[2 * edges[i]]]);
		drawing_line_to(drawing, path, sheet->at[sheet->ends[2 * edges[i] + 1]]);
	}
}

static void add_mesh(struct drawing *drawing, const struct sheet *sheet)
{
	uint32_t all[EDGES_MOST];
	for (uint32_t e = 0; e < sheet->edge_count; e++)
		all[e] = e;
	drawing_begin_layer(drawing, "mesh", "mesh");
	add_edges(drawing, sheet, all, sheet->edge_count, &gone_style);
}

static void finish(struct drawing *drawing, const struct sheet *sheet, uint32_t root, const char *says,
		   const char *folder, const char *name)
{
	drawing_begin_layer(drawing, "terminals", "terminals");
	for (uint32_t t = 0; t < TERMINALS; t++)
		drawing_add_circle(drawing, sheet->terminal[t] == root ? &root_style : &terminal_style, DRAWING_NONE,
				   sheet->at[sheet->terminal[t]], 1.8);
	drawing_add_text(drawing, &text_style, DRAWING_NONE,
			 &(struct drawing_text){.at = {margin, drawing->height - 6}, .size_mm = 4, .text = says});
	char path[4096];
	snprintf(path, sizeof path, "%s/%s.svg", folder, name);
	FILE *file = fopen(path, "w");
	struct text text = {0};
	svg_write(drawing, &text);
	if (!file || text.failed || fwrite(text.bytes, 1, text.size, file) != text.size || fclose(file)) {
		fprintf(stderr, "solve_pictures: cannot write %s\n", path);
		exit(1);
	}
	text_clear(&text);
}

static struct search open_search(const struct sheet *sheet, const struct steiner_options *options,
				 struct steiner_stats *stats)
{
	struct search search = {
		.graph = &sheet->graph,
		.terminals = sheet->terminal,
		.terminal_count = TERMINALS,
		.options = options,
		.stats = stats,
		.arena = sheet->arena,
		.best_weight = UINT64_MAX,
		.best_edges = ARENA_ARRAY(sheet->arena, VERTICES, uint32_t),
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
		.stage = "picture",
	};
	uint32_t apart[2];
	must(search.best_edges ? TW_OK : TW_ERROR_MEMORY);
	must(instance_init(&search.instance, sheet->arena, &sheet->graph, sheet->terminal, TERMINALS, NULL, true,
			   apart));
	must(primal_first(&search));
	return search;
}

/* The sheet's vertex that is `vertex` in the instance: an edge of both tells. */
static uint32_t name_of(const struct sheet *sheet, const struct search *search, uint32_t vertex)
{
	const struct instance *instance = &search->instance;
	const uint32_t e = instance->edge[instance->first[vertex]];
	return sheet->ends[2 * instance->origin[e] + (instance->ends[2 * e] != vertex)];
}

static double percent_below(const struct dual *dual, const struct search *search, uint64_t optimum)
{
	const double bound = (double)(dual_fine_bound(dual) >> search->instance.shift);
	return 100 * (1 - bound / (double)optimum);
}

static void draw_balls(const struct sheet *sheet, const struct search *search, const struct dual *dual,
		       uint64_t optimum, const char *folder)
{
	struct drawing drawing = new_drawing(sheet, "Balls of the first ascent");
	uint32_t owner[VERTICES], grown[TERMINALS] = {0};
	memset(owner, 0xff, sizeof owner);
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		if (grown[ball->terminal]++ >= TURNS)
			continue;
		for (uint32_t i = 0; i < ball->count; i++) {
			const uint32_t v = name_of(sheet, search, dual->member[ball->start + i].vertex);
			owner[v] = owner[v] == INSTANCE_NONE ? ball->terminal : owner[v];
		}
	}
	add_mesh(&drawing, sheet);
	drawing_begin_layer(&drawing, "balls", "balls");
	for (uint32_t v = 0; v < VERTICES; v++)
		if (owner[v] != INSTANCE_NONE)
			drawing_add_circle(&drawing, &ball_style[owner[v] % COLOURS], DRAWING_NONE, sheet->at[v], 1.1);
	const char *says = drawing_format(
		&drawing, "first turns of the ascent, which ends %.2f %% below the optimum; first tree: %.2f %% above",
		percent_below(dual, search, optimum), 100 * ((double)search->best_weight / (double)optimum - 1));
	finish(&drawing, sheet, name_of(sheet, search, search->instance.terminal[dual->root]), says, folder, "balls");
}

static void draw_flow(const struct sheet *sheet, const struct search *search, const struct flow *flow,
		      const struct dual *dual, uint64_t optimum, const char *folder)
{
	struct drawing drawing = new_drawing(sheet, "Prices of the flow");
	uint32_t chosen[EDGES_MOST];
	add_mesh(&drawing, sheet);
	drawing_begin_layer(&drawing, "flow", "prices");
	for (uint32_t shade = 0; shade < SHADES; shade++) {
		uint32_t count = 0;
		for (uint32_t e = 0; e < search->instance.edge_count; e++) {
			const struct flow_price both = flow->price[flow->slot[e]]; /* no edge is gone yet */
			const double price = flow->omega * (both.forward + both.backward);
			const double step = price * (SHADES + 1);
			if (step >= shade + 0.25 && (step < shade + 1.25 || shade + 1 == SHADES))
				chosen[count++] = search->instance.origin[e];
		}
		add_edges(&drawing, sheet, chosen, count, &flow_style[shade]);
	}
	const char *says = drawing_format(&drawing, "%d iterations; bound: %.3f %% below the optimum", ITERATIONS,
					  percent_below(dual, search, optimum));
	finish(&drawing, sheet, name_of(sheet, search, search->instance.terminal[dual->root]), says, folder, "flow");
}

static void draw_rest(const struct sheet *sheet, struct search *search, const struct dual *dual, const char *folder)
{
	struct drawing drawing = new_drawing(sheet, "What the bound leaves");
	const uint32_t root = name_of(sheet, search, search->instance.terminal[dual->root]);
	struct dual next;
	int empty;
	must(fix_by_reduced_costs(search, dual, search_cutoff(search), &next, &empty));
	add_mesh(&drawing, sheet);
	drawing_begin_layer(&drawing, "left", "what is left");
	add_edges(&drawing, sheet, search->instance.origin, search->instance.edge_count, &mesh_style);
	const char *says =
		drawing_format(&drawing, "left: %u of %d vertices, %u of %u edges", search->instance.vertex_count,
			       VERTICES, search->instance.edge_count, sheet->edge_count);
	finish(&drawing, sheet, root, says, folder, "left");
}

static void draw_tree(const struct sheet *sheet, const struct steiner_tree *tree, uint32_t root, const char *folder)
{
	struct drawing drawing = new_drawing(sheet, "The optimum");
	add_mesh(&drawing, sheet);
	drawing_begin_layer(&drawing, "tree", "tree");
	add_edges(&drawing, sheet, tree->edges, tree->edge_count, &tree_style);
	const char *says =
		drawing_format(&drawing, "%u edges, %u sets and %llu labels of the dynamic program", tree->edge_count,
			       (unsigned)tree->stats.sets, (unsigned long long)tree->stats.labels);
	finish(&drawing, sheet, root, says, folder, "tree");
}

int main(int argc, char **argv)
{
	if (argc != 2) {
		fprintf(stderr, "usage: solve_pictures FOLDER\n");
		return 2;
	}
	static struct sheet sheet;
	static const struct steiner_options options;
	struct steiner_stats stats = {0};
	struct steiner_tree tree;
	struct dual ascended, split;
	struct flow *flow;
	sheet.arena = arena_new(0);
	must(sheet.arena ? TW_OK : TW_ERROR_MEMORY);
	make_sheet(&sheet);
	must(steiner_solve(&sheet.graph, sheet.terminal, TERMINALS, &options, sheet.arena, &tree, NULL));
	struct search search = open_search(&sheet, &options, &stats);
	must(dual_ascend_best(&ascended, &search, 1));
	const uint32_t root = name_of(&sheet, &search, search.instance.terminal[ascended.root]);
	draw_balls(&sheet, &search, &ascended, tree.weight, argv[1]);
	must(flow_new(&flow, &search, &ascended));
	must(flow_iterate(flow, &search, ITERATIONS));
	must(dual_init_like(&split, &search, &ascended, flow_members(flow)));
	must(flow_split(flow, &search, &split));
	draw_flow(&sheet, &search, flow, &split, tree.weight, argv[1]);
	must(search_offer_leaves(&search, tree.edges, tree.edge_count));
	draw_rest(&sheet, &search, &split, argv[1]);
	draw_tree(&sheet, &tree, root, argv[1]);
	arena_free(sheet.arena);
	return 0;
}
