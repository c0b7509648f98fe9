/* For benches of the solver: the sample suit as a graph. Its motions give the strain, the strain the weights, like
 * those of a layout; refined meshes inherit the strain of the faces that they were cut from. */
#ifndef TESTS_BENCH_SUIT_H
#define TESTS_BENCH_SUIT_H

#include "solver/field/field.h"
#include "solver/field/strain.h"
#include "solver/garment/refine.h"
#include "solver/sample/sample.h"

#include <stdlib.h>
#include <string.h>

enum { SUIT_EVERY_FRAME = 8, SUIT_CHILDREN = 4 /* of a face, by midpoints */ };

struct suit {
	struct garment garment;
	struct topology topology;
	struct field field;
	uint32_t *terminal; /* [terminal_count] vertices, distinct */
	uint32_t terminal_count;
};

static inline void suit_must(enum tw_status status, const struct tw_error *error)
{
	if (status == TW_OK)
		return;
	fprintf(stderr, "suit: %s %s\n", error->where, error->text);
	exit(1);
}

static inline void *suit_need(void *memory)
{
	if (!memory)
		exit(1);
	return memory;
}

/* The largest over the sample's motions of the mean density over (every eighth of) their frames. */
static inline double *suit_density(const struct garment *garment, struct arena *arena)
{
	struct tw_error error = {0};
	struct sample_rig *rig;
	struct strain_rest rest;
	struct strain_mean *mean;
	double *density = suit_need(ARENA_ZEROED(arena, garment->face_count, double));
	double *means[STRAIN_MODELS] = {suit_need(ARENA_ARRAY(arena, garment->face_count, double))};
	suit_must(sample_rig_build(&rig, arena, garment, SAMPLE_L, &error), &error);
	suit_must(strain_rest_from_pattern(&rest, arena, garment, &error), &error);
	suit_must(strain_mean_new(&mean, arena, &rest, &error), &error);
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++) {
		for (uint32_t j = 0; j < sample_motion_at(m)->frame_count; j += SUIT_EVERY_FRAME) {
			sample_rig_pose(rig, m, j, strain_mean_slot(mean));
			strain_mean_add(mean);
		}
		strain_mean_finish(mean, means);
		strain_raise(density, means[0], garment->face_count);
	}
	return density;
}

/* Terminals on vertices: of a place inside a face, the face's first corner. Refinement keeps the numbers. */
static inline void suit_place(struct suit *suit, struct arena *arena, const char *set)
{
	struct tw_error error = {0};
	struct sample_terminal *place;
	uint32_t number = 0, count;
	while (number < SAMPLE_TERMINAL_SETS && strcmp(sample_terminal_set_name(number), set) != 0)
		number++;
	if (number == SAMPLE_TERMINAL_SETS)
		exit(2);
	suit_must(sample_terminals(&place, &count, arena, &suit->garment, SAMPLE_L, number, &error), &error);
	suit->terminal = suit_need(ARENA_ARRAY(arena, count, uint32_t));
	suit->terminal_count = 0;
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t vertex = place[i].face == GARMENT_NONE
						? place[i].vertex
						: suit->garment.face_vertex[3 * (size_t)place[i].face];
		uint32_t equal = 0;
		while (equal < suit->terminal_count && suit->terminal[equal] != vertex)
			equal++;
		if (equal == suit->terminal_count)
			suit->terminal[suit->terminal_count++] = vertex;
	}
}

/* A suit of about `vertices` vertices, refined `rounds` times (each quadruples them), with the sample's terminals of
 * this name. Ends the program where anything fails. */
static inline void suit_make(struct suit *suit, struct arena *arena, uint32_t vertices, unsigned rounds,
			     const char *set)
{
	struct tw_error error = {0};
	struct field_options options;
	suit_must(sample_garment(&suit->garment, arena, vertices, SAMPLE_L, &error), &error);
	suit_place(suit, arena, set);
	double *density = suit_density(&suit->garment, arena);
	suit_must(topology_build(&suit->topology, arena, &suit->garment, &error), &error);
	for (unsigned round = 0; round < rounds; round++) {
		const struct garment coarse = suit->garment;
		suit_must(garment_refine(&suit->garment, arena, &coarse, &suit->topology, REFINE_MIDPOINT, &error),
			  &error);
		suit_must(topology_build(&suit->topology, arena, &suit->garment, &error), &error);
		double *fine = suit_need(ARENA_ARRAY(arena, suit->garment.face_count, double));
		for (uint32_t f = 0; f < suit->garment.face_count; f++)
			fine[f] = density[f / SUIT_CHILDREN];
		density = fine;
	}
	option_defaults(&field_option_table, &options);
	suit_must(field_weigh(&suit->field, arena, &suit->garment, &suit->topology, density, &options, NULL, 2, &error),
		  &error);
}

#endif
