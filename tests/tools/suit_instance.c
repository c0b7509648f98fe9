/* suit_instance VERTICES ROUNDS SET: writes the Steiner instance of the sample suit, refined ROUNDS times by midpoints,
 * with the terminals SET (joints10, segments17, muscles36, muscles80), as a PACE file to stdout. */
#include "tests/bench/suit.h"

int main(int argc, char **argv)
{
	if (argc != 4) {
		fprintf(stderr, "usage: suit_instance VERTICES ROUNDS SET\n");
		return 2;
	}
	struct arena *arena = arena_new(0);
	struct suit suit;
	suit_make(&suit, arena, (uint32_t)strtoul(argv[1], NULL, 10), (unsigned)strtoul(argv[2], NULL, 10), argv[3]);
	printf("SECTION Graph\nNodes %u\nEdges %u\n", suit.garment.vertex_count, suit.topology.edge_count);
	for (uint32_t e = 0; e < suit.topology.edge_count; e++)
		printf("E %u %u %llu\n", suit.topology.edge_vertex[2 * (size_t)e] + 1,
		       suit.topology.edge_vertex[2 * (size_t)e + 1] + 1, (unsigned long long)suit.field.weight[e]);
	printf("END\n\nSECTION Terminals\nTerminals %u\n", suit.terminal_count);
	for (uint32_t i = 0; i < suit.terminal_count; i++)
		printf("T %u\n", suit.terminal[i] + 1);
	printf("END\n\nEOF\n");
	arena_free(arena);
	return 0;
}
