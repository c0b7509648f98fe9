/* Edge weights of a suit: time, and the same integrals by GEOS, the engine under Shapely, in the same run. The GEOS
 * side is what one would write: a tree of all face polygons, and for each strip the area of its intersection with each
 * face that the tree finds. That knows of no seams, so the two are compared on edges whose strip does not reach one
 * (the tests compare the others). */
#include "solver/field/field.h"
#include "solver/field/strip.h"
#include "solver/sample/sample.h"

#include "tests/bench/bench.h"
#include "tests/oracle/geos_strip.h"
#include "tests/oracle/meshes.h"

#include <string.h>
#include <sys/resource.h>

enum { GEOS_EVERY = 20, ROUNDS = 20 };

struct suit {
	struct garment garment;
	struct topology topology;
	struct field_options options;
	struct field field;
	double *density;
};

static void make_suit(struct suit *suit, struct arena *arena, uint32_t vertices)
{
	if (sample_garment(&suit->garment, arena, vertices, SAMPLE_L, NULL))
		exit(1);
	suit->density = ARENA_ARRAY(arena, suit->garment.face_count, double);
	if (topology_build(&suit->topology, arena, &suit->garment, NULL) || !suit->density)
		exit(1);
	uint64_t random = 1;
	for (uint32_t f = 0; f < suit->garment.face_count; f++)
		suit->density[f] = mesh_random(&random);
	option_defaults(&field_option_table, &suit->options);
}

static double weigh(struct suit *suit, struct arena *arena, unsigned threads)
{
	struct arena_mark mark = arena_mark(arena);
	double start = bench_wall_seconds();
	if (field_weigh(&suit->field, arena, &suit->garment, &suit->topology, suit->density, &suit->options, NULL,
			threads, NULL))
		exit(1);
	double seconds = bench_wall_seconds() - start;
	arena_release(arena, mark);
	return seconds;
}

struct geos_hits {
	const GEOSGeometry *rectangle;
	const double *value;
	double cost, area;
};

static void count_hit(void *item, void *context)
{
	const struct bench_face {
		GEOSGeometry *polygon;
		uint32_t number;
	} *face = item;
	struct geos_hits *hits = context;
	double area = geos_common_area(face->polygon, hits->rectangle);
	hits->area += area;
	hits->cost += area * hits->value[face->number];
}

static void compare_with_geos(struct suit *suit, struct arena *arena, double ours_s)
{
	struct geos_face {
		GEOSGeometry *polygon;
		uint32_t number;
	} *faces = ARENA_ARRAY(arena, suit->garment.face_count, struct geos_face);
	double *value = ARENA_ARRAY(arena, suit->garment.face_count, double);
	initGEOS(geos_print, geos_print);
	GEOSSTRtree *tree = GEOSSTRtree_create(10);
	for (uint32_t f = 0; f < suit->garment.face_count; f++) {
		double x[3], y[3];
		for (size_t k = 0; k < 3; k++) {
			const double *u =
				suit->garment.pattern + 2 * (size_t)suit->garment.face_coord[3 * (size_t)f + k];
			x[k] = u[0];
			y[k] = u[1];
		}
		faces[f] = (struct geos_face){geos_polygon(3, x, y), f};
		GEOSSTRtree_insert(tree, faces[f].polygon, &faces[f]);
	}
	field_value(&suit->field, NULL, value);
	struct strip_fabric fabric;
	struct strip_walker *walker;
	if (strip_fabric_build(&fabric, arena, &suit->garment, &suit->topology, value, NULL) ||
	    strip_walker_new(&walker, arena, &fabric, NULL))
		exit(1);
	double geos_s = 0, difference = 0;
	uint32_t done = 0, compared = 0;
	for (uint32_t e = 0; e < suit->topology.edge_count; e += GEOS_EVERY) {
		uint32_t f = suit->topology.edge_face[2 * (size_t)e], k = suit->topology.edge_side[2 * (size_t)e];
		const uint32_t *coord = suit->garment.face_coord + 3 * (size_t)f;
		double start = bench_seconds();
		GEOSGeometry *rectangle =
			geos_rectangle(suit->garment.pattern + 2 * (size_t)coord[k],
				       suit->garment.pattern + 2 * (size_t)coord[(k + 1) % 3], -7.5, 7.5);
		struct geos_hits hits = {rectangle, value, 0, 0};
		GEOSSTRtree_query(tree, rectangle, count_hit, &hits);
		GEOSGeom_destroy(rectangle);
		geos_s += bench_seconds() - start;
		done++;
		struct strip strip;
		strip_edge(walker, e, 15, &strip);
		if (hits.area < strip.area_mm2 * (1 - 1e-9))
			continue;
		double off = fabs(hits.cost - strip.cost) / hits.cost;
		difference = off > difference ? off : difference;
		compared++;
	}
	geos_s *= (double)suit->topology.edge_count / done;
	bench_line("field.geos", geos_s * 1e3, "ms", 0);
	bench_line("field.times_faster_than_geos", geos_s / ours_s, "x", -200);
	bench_line("field.geos_compared_edges", compared, "", 0);
	bench_line("field.geos_largest_difference", difference, "", 1e-9);
	GEOSSTRtree_destroy(tree);
	finishGEOS();
}

int main(void)
{
	struct arena *arena = arena_new(0);
	struct suit suit;
	make_suit(&suit, arena, 23500);
	double one = 1e9, two = 1e9;
	for (int round = 0; round < ROUNDS; round++) {
		one = fmin(one, weigh(&suit, arena, 1));
		two = fmin(two, weigh(&suit, arena, 2));
	}
	bench_line("field.edges", suit.topology.edge_count, "", 0);
	bench_line("field.weights_one_thread", one * 1e3, "ms", 1500);
	bench_line("field.weights_two_threads", two * 1e3, "ms", 60);
	compare_with_geos(&suit, arena, two);
	arena_free(arena);

	arena = arena_new(0);
	make_suit(&suit, arena, 727000);
	clock_t before = clock();
	double large = weigh(&suit, arena, 2);
	double processor = (double)(clock() - before) / CLOCKS_PER_SEC;
	struct rusage usage;
	getrusage(RUSAGE_SELF, &usage);
	bench_line("field.large_vertices", suit.garment.vertex_count, "", 0);
	bench_line("field.large_weights_two_threads", large, "s", 3);
	bench_line("field.large_weights_processor_time", processor, "s", 0);
	bench_line("field.large_process_memory", (double)usage.ru_maxrss / 1048576, "GiB", 2);

	uint64_t random = 1;
	mesh_shuffle_faces(&suit.garment, &random);
	if (topology_build(&suit.topology, arena, &suit.garment, NULL))
		exit(1);
	before = clock();
	weigh(&suit, arena, 2);
	processor = (double)(clock() - before) / CLOCKS_PER_SEC;
	bench_line("field.large_faces_in_random_order", processor, "s", 0);
	arena_free(arena);
	return 0;
}
