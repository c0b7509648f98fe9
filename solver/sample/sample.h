/* A suit to start with: a full-body tight suit with its pattern, its motions and places for electronics, made from
 * nothing but the tables in this folder; no file, no network, the same on every machine.
 *
 * The wearer is a man of 175 cm in size L (M 170, XL 182), y up from the floor, +z forward, +x to his left,
 * millimetres, arms held away from the body. The suit has twelve pieces (torso, sleeve and leg, each front and back,
 * left and right) and five openings (neck, wrists, ankles). Its pattern is smaller than the body, as that of a real
 * tight suit: 6 % in girth, 3 % in length. Left and right are exact mirror images. All sizes of one vertex count share
 * vertex order, faces and pieces, so that a layout of one is a layout of all. */
#ifndef SOLVER_SAMPLE_SAMPLE_H
#define SOLVER_SAMPLE_SAMPLE_H

#include "solver/arena.h"
#include "solver/garment/garment.h"
#include "tightwire.h"

#define SAMPLE_VERTICES_MIN 2500u
#define SAMPLE_VERTICES_MAX 1000000u

enum sample_size { SAMPLE_M, SAMPLE_L, SAMPLE_XL };

/* Fills *garment with a suit of about `vertices` vertices (within 1.5 %). Its arrays live in `arena`; what was needed
 * on the way is given back. TW_ERROR_INPUT when `vertices` is outside the limits above; TW_ERROR_MEMORY. */
enum tw_status sample_garment(struct garment *garment, struct arena *arena, uint32_t vertices, enum sample_size size,
			      struct tw_error *error) TW_NODISCARD;

/* One motion: joint angles in keys, played smoothly. Every motion begins near the rest pose of a standing wearer. */
struct sample_motion {
	const char *name; /* "walk" */
	uint32_t frame_count;
	double frames_per_second;
};

enum { SAMPLE_MOTIONS = 6 };

/* `index` < SAMPLE_MOTIONS. */
const struct sample_motion *sample_motion_at(uint32_t index);

/* How strongly each bone moves each vertex; made once for a garment of sample_garment, used for every frame. */
struct sample_rig;
enum tw_status sample_rig_build(struct sample_rig **rig, struct arena *arena, const struct garment *garment,
				enum sample_size size, struct tw_error *error) TW_NODISCARD;

/* Writes the worn positions in one frame of a motion, mm: position[vertex_count][3]. `frame` < its frame_count. A frame
 * depends on nothing but its number. The rig keeps scratch space: not for two threads at once. */
void sample_rig_pose(struct sample_rig *rig, uint32_t motion, uint32_t frame, float *position);

/* A place for electronics: a vertex (face == GARMENT_NONE), or a point inside a face. */
struct sample_terminal {
	char name[48]; /* "elbow_left" */
	uint32_t vertex;
	uint32_t face;
	double barycentric[3];
};

/* The sets: "joints10" and "segments17" on vertices, "muscles36" and "muscles80" inside faces; each left-right
 * symmetric. */
enum { SAMPLE_TERMINAL_SETS = 4 };

/* Name of a set; `index` < SAMPLE_TERMINAL_SETS. */
const char *sample_terminal_set_name(uint32_t index);

/* Places a set on a garment of sample_garment: *terminals [*count], in the arena. */
enum tw_status sample_terminals(struct sample_terminal **terminals, uint32_t *count, struct arena *arena,
				const struct garment *garment, enum sample_size size, uint32_t set,
				struct tw_error *error) TW_NODISCARD;

#endif
