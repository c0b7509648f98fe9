#include "solver/layout/unfold.h"

#include <assert.h>
#include <string.h>

/* The choice of sides, as a dynamic program along the strand. */
struct choice {
	struct laid_edge laid[2];
	uint32_t count;
	uint32_t changes[2]; /* least changes of piece up to here, when this side is taken */
	uint8_t before[2];   /* the side of the leg before that gives them */
};

static uint32_t strand_length(const struct branch_set *set, const struct strand *strand)
{
	uint32_t edges = 0;
	for (uint32_t i = 0; i < strand->count; i++)
		edges += set->branch[set->step[strand->first + i].branch].edge_count;
	return edges;
}

static void list_nodes(struct unfolded *unfolded, const struct branch_set *set, const struct strand *strand)
{
	uint32_t leg = 0;
	for (uint32_t i = 0; i < strand->count; i++) {
		const struct strand_step *step = &set->step[strand->first + i];
		const struct branch *branch = &set->branch[step->branch];
		for (uint32_t k = 0; k < branch->edge_count; k++, leg++) {
			uint32_t last = branch->edge_count;
			unfolded->edge[leg] = branch->edge[step->reversed ? last - 1 - k : k];
			unfolded->node[leg] = branch->node[step->reversed ? last - k : k];
			unfolded->node[leg + 1] = branch->node[step->reversed ? last - 1 - k : k + 1];
		}
	}
}

static void choose_sides(struct choice *choice, const struct unfolded *unfolded, const struct network *network)
{
	for (uint32_t leg = 0; leg + 1 < unfolded->count; leg++) {
		struct choice *here = &choice[leg];
		here->count = network_lay(network, unfolded->edge[leg], unfolded->node[leg], here->laid);
		for (uint32_t s = 0; s < here->count; s++) {
			here->changes[s] = leg ? UINT32_MAX : 0;
			here->before[s] = 0;
			for (uint32_t b = 0; leg && b < here[-1].count; b++) {
				bool change = here[-1].laid[b].to_key != here->laid[s].from_key;
				uint32_t changes = here[-1].changes[b] + change;
				if (changes >= here->changes[s])
					continue;
				here->changes[s] = changes;
				here->before[s] = (uint8_t)b;
			}
		}
	}
	/* Backwards, the chosen side of every leg moves to the front. */
	uint32_t last = unfolded->count - 2;
	uint8_t side = choice[last].count == 2 && choice[last].changes[1] < choice[last].changes[0];
	for (uint32_t leg = unfolded->count - 1; leg-- > 0;) {
		uint8_t before = choice[leg].before[side];
		choice[leg].laid[0] = choice[leg].laid[side];
		side = before;
	}
}

static struct vec2 side_direction(const struct garment *garment, uint32_t face, uint32_t from, uint32_t to)
{
	const uint32_t *coord = &garment->face_coord[3 * (size_t)face];
	const double *a = &garment->pattern[2 * (size_t)coord[from]], *b = &garment->pattern[2 * (size_t)coord[to]];
	return vec2_unit((struct vec2){b[0] - a[0], b[1] - a[1]});
}

static uint32_t corner_of_vertex(const struct garment *garment, uint32_t face, uint32_t vertex)
{
	const uint32_t *corner = &garment->face_vertex[3 * (size_t)face];
	assert(corner[0] == vertex || corner[1] == vertex || corner[2] == vertex);
	return corner[0] == vertex ? 0 : corner[1] == vertex ? 1 : 2;
}

/* Walks around a vertex, to the left or to the right, from `face` to the pattern position `to_key`; the rotation takes
 * directions of the plane that was reached to the plane of `face`. False when a hem is in the way. */
static bool walk_around(const struct network *network, uint32_t vertex, uint32_t face, uint64_t to_key, bool left,
			struct vec2 *rotation)
{
	const struct garment *garment = network->garment;
	const struct topology *topology = network->topology;
	*rotation = (struct vec2){1, 0};
	for (uint32_t first = face, guard = 0; guard == 0 || face != first; guard++) {
		uint32_t k = corner_of_vertex(garment, face, vertex);
		if (garment->face_coord[3 * (size_t)face + k] == to_key)
			return true;
		uint32_t edge = topology->face_edge[3 * (size_t)face + (left ? (k + 2) % 3 : k)];
		const uint32_t *pair = &topology->edge_face[2 * (size_t)edge];
		uint32_t next = pair[0] == face ? pair[1] : pair[0];
		if (next == GARMENT_NONE)
			return false;
		uint32_t next_k = corner_of_vertex(garment, next, vertex);
		struct vec2 here = side_direction(garment, face, k, left ? (k + 2) % 3 : (k + 1) % 3);
		struct vec2 there = side_direction(garment, next, next_k, left ? (next_k + 1) % 3 : (next_k + 2) % 3);
		struct vec2 turn = {vec2_dot(there, here), vec2_cross(there, here)};
		*rotation = vec2_rotate(*rotation, turn);
		face = next;
	}
	return false;
}

/* Across the edge that the node lies in: from the plane of the face behind to that of `face`. */
static struct vec2 turn_across(const struct network *network, uint32_t edge, uint32_t face)
{
	const uint32_t *faces = &network->topology->edge_face[2 * (size_t)edge];
	const uint8_t *sides = &network->topology->edge_side[2 * (size_t)edge];
	uint32_t here_at = faces[0] == face ? 0 : 1, k = sides[here_at], next = faces[1 - here_at],
		 l = sides[1 - here_at];
	struct vec2 here = side_direction(network->garment, face, k, (k + 1) % 3);
	struct vec2 there = side_direction(network->garment, next, (l + 1) % 3, l);
	return (struct vec2){vec2_dot(there, here), vec2_cross(there, here)};
}

static struct vec2 turn_at(const struct network *network, uint32_t vertex, uint32_t face, uint64_t to_key)
{
	struct vec2 left, right;
	if (vertex >= network->garment->vertex_count)
		return turn_across(network, network_site(network, vertex)->edge, face);
	bool by_left = walk_around(network, vertex, face, to_key, true, &left);
	bool by_right = walk_around(network, vertex, face, to_key, false, &right);
	if (by_left && by_right && vec2_dot(left, right) > -0.99)
		return vec2_unit(vec2_add(left, right));
	return by_left ? left : by_right ? right : (struct vec2){1, 0};
}

/* Lays the pieces one after the other. */
static void place_runs(struct unfolded *unfolded, const struct choice *choice, const struct network *network)
{
	struct run *run = unfolded->run;
	*run = (struct run){.piece = choice[0].laid[0].piece, .placement = PLACEMENT_IDENTITY};
	unfolded->point[0] = choice[0].laid[0].from;
	unfolded->key_in[0] = choice[0].laid[0].from_key;
	unfolded->crossing[0] = false;
	for (uint32_t leg = 0; leg + 1 < unfolded->count; leg++) {
		const struct laid_edge *laid = &choice[leg].laid[0];
		unfolded->key_out[leg] = laid->from_key;
		unfolded->crossing[leg] = leg && choice[leg - 1].laid[0].to_key != laid->from_key;
		if (unfolded->crossing[leg]) {
			struct vec2 turn =
				turn_at(network, unfolded->node[leg], choice[leg - 1].laid[0].face, laid->from_key);
			struct vec2 rotation = vec2_unit(vec2_rotate(run->placement.rotation, turn));
			run++;
			run->piece = laid->piece;
			run->placement.rotation = rotation;
			run->placement.shift = vec2_sub(unfolded->point[leg], vec2_rotate(laid->from, rotation));
		}
		unfolded->leg_run[leg] = (uint32_t)(run - unfolded->run);
		unfolded->leg_face[leg] = laid->face;
		unfolded->leg_from[leg] = laid->from;
		unfolded->leg_to[leg] = laid->to;
		unfolded->point[leg + 1] = placement_apply(run->placement, laid->to);
		unfolded->key_in[leg + 1] = laid->to_key;
	}
	unfolded->key_out[unfolded->count - 1] = unfolded->key_in[unfolded->count - 1];
	unfolded->crossing[unfolded->count - 1] = false;
	unfolded->run_count = (uint32_t)(run - unfolded->run) + 1;
}

enum tw_status strand_unfold(struct unfolded *unfolded, struct arena *arena, const struct network *network,
			     const struct branch_set *set, const struct strand *strand, struct tw_error *error)
{
	uint32_t legs = strand_length(set, strand);
	*unfolded = (struct unfolded){.count = legs + 1};
	/* Room for strand_extend at both ends. */
	unfolded->node = ARENA_ARRAY(arena, legs + 3, uint32_t);
	unfolded->edge = ARENA_ARRAY(arena, legs + 2, uint32_t);
	unfolded->leg_run = ARENA_ARRAY(arena, legs + 2, uint32_t);
	unfolded->leg_face = ARENA_ARRAY(arena, legs + 2, uint32_t);
	unfolded->point = ARENA_ARRAY(arena, legs + 3, struct vec2);
	unfolded->leg_from = ARENA_ARRAY(arena, legs + 2, struct vec2);
	unfolded->leg_to = ARENA_ARRAY(arena, legs + 2, struct vec2);
	unfolded->crossing = ARENA_ARRAY(arena, legs + 3, bool);
	unfolded->key_in = ARENA_ARRAY(arena, legs + 3, uint64_t);
	unfolded->key_out = ARENA_ARRAY(arena, legs + 3, uint64_t);
	unfolded->run = ARENA_ARRAY(arena, legs + 2, struct run);
	struct choice *choice = ARENA_ARRAY(arena, legs, struct choice);
	if (!unfolded->node || !unfolded->edge || !unfolded->leg_run || !unfolded->leg_face || !unfolded->point ||
	    !unfolded->leg_from || !unfolded->leg_to || !unfolded->crossing || !unfolded->key_in ||
	    !unfolded->key_out || !unfolded->run || !choice)
		return tw_fail_memory(error);
	list_nodes(unfolded, set, strand);
	choose_sides(choice, unfolded, network);
	place_runs(unfolded, choice, network);
	return TW_OK;
}

/* Makes room for a node, a leg and a run before the first. */
static void shift_up(struct unfolded *unfolded)
{
	uint32_t nodes = unfolded->count, legs = nodes - 1;
	memmove(unfolded->node + 1, unfolded->node, nodes * sizeof *unfolded->node);
	memmove(unfolded->point + 1, unfolded->point, nodes * sizeof *unfolded->point);
	memmove(unfolded->crossing + 1, unfolded->crossing, nodes * sizeof *unfolded->crossing);
	memmove(unfolded->key_in + 1, unfolded->key_in, nodes * sizeof *unfolded->key_in);
	memmove(unfolded->key_out + 1, unfolded->key_out, nodes * sizeof *unfolded->key_out);
	memmove(unfolded->edge + 1, unfolded->edge, legs * sizeof *unfolded->edge);
	memmove(unfolded->leg_face + 1, unfolded->leg_face, legs * sizeof *unfolded->leg_face);
	memmove(unfolded->leg_from + 1, unfolded->leg_from, legs * sizeof *unfolded->leg_from);
	memmove(unfolded->leg_to + 1, unfolded->leg_to, legs * sizeof *unfolded->leg_to);
	memmove(unfolded->run + 1, unfolded->run, unfolded->run_count * sizeof *unfolded->run);
	for (uint32_t leg = legs; leg > 0; leg--)
		unfolded->leg_run[leg] = unfolded->leg_run[leg - 1] + 1;
}

void strand_extend(struct unfolded *unfolded, const struct network *network, uint32_t which,
		   const struct beyond *beyond)
{
	uint32_t last = unfolded->count - 1, end = which ? last : 0, leg = which ? last - 1 : 0;
	uint32_t vertex = unfolded->node[end], face = unfolded->leg_face[leg], edge = unfolded->edge[leg];
	struct vec2 seam_point = unfolded->point[end], turn = turn_at(network, vertex, face, beyond->key);
	struct run run = {.piece = beyond->piece};
	const double *uv = &network->garment->pattern[2 * (size_t)beyond->key];
	run.placement.rotation = vec2_unit(vec2_rotate(unfolded->run[unfolded->leg_run[leg]].placement.rotation, turn));
	run.placement.shift = vec2_sub(seam_point, vec2_rotate((struct vec2){uv[0], uv[1]}, run.placement.rotation));
	if (!which)
		shift_up(unfolded);
	uint32_t fresh = which ? last + 1 : 0, hop = which ? last : 0, crossing = which ? last : 1;
	unfolded->count++;
	unfolded->node[fresh] = vertex;
	unfolded->point[fresh] = placement_apply(run.placement, beyond->at);
	unfolded->crossing[fresh] = false;
	unfolded->crossing[crossing] = true;
	unfolded->key_in[fresh] = unfolded->key_out[fresh] = beyond->key;
	*(which ? &unfolded->key_out[crossing] : &unfolded->key_in[crossing]) = beyond->key;
	unfolded->edge[hop] = edge;
	unfolded->leg_face[hop] = face;
	/* The tree's path ends at the seam. */
	unfolded->leg_from[hop] = unfolded->leg_to[hop] = (struct vec2){uv[0], uv[1]};
	unfolded->leg_run[hop] = which ? unfolded->run_count : 0;
	unfolded->run[which ? unfolded->run_count : 0] = run;
	unfolded->run_count++;
}
