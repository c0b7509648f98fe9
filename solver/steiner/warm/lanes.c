/* Purpose: lay a warm state's lanes on the graph as it is.
 *
 * Terminals that are gone take their lanes along, and so does one terminal that becomes the root where the old root is
 * gone: every other lane is cut off at its potential there, because no cut may hold the root. Vertices that are new get
 * potentials between those of their neighbours; a lane that finds no room there is given up. What the lanes take from
 * each arc is summed over the costs as they are, so that nothing need be believed of the state. */
#include "solver/steiner/warm/lanes.h"

#include "solver/steiner/dual/ball.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* A unit of work is some 10 ns; ten vectors of four lanes take about as long. */
enum { LANES_FOR_A_UNIT = 40 };

typedef int32_t vector __attribute__((vector_size(4 * WARM_LANES)));

static bool allocate(struct warm_lanes *lanes, const struct steiner_warm *warm, struct search *search)
{
	struct arena *arena = search->arena;
	const struct instance *instance = &search->instance;
	*lanes = (struct warm_lanes){
		.warm = warm,
		.vertex_of = ARENA_ARRAY(arena, instance->vertex_count, uint32_t),
		.row = ARENA_ARRAY(arena, instance->vertex_count, int32_t *),
		.lane_of = ARENA_ARRAY(arena, instance->terminal_count, uint32_t),
		.flow_of = ARENA_ARRAY(arena, instance->terminal_count, uint32_t),
		.most = ARENA_ZEROED(arena, warm->stride, int32_t),
	};
	return lanes->vertex_of && lanes->row && lanes->lane_of && lanes->flow_of && lanes->most;
}

static uint32_t lane_of(const struct steiner_warm *warm, warm_key key)
{
	for (uint32_t lane = 0; lane < warm->lane_count; lane++)
		if (warm->lane[lane] == key)
			return lane;
	return INSTANCE_NONE;
}

static void find_rows(struct warm_lanes *lanes, const struct search *search)
{
	const struct steiner_warm *warm = lanes->warm;
	warm_name_vertices(search, lanes->vertex_of);
	for (uint32_t v = 0; v < search->instance.vertex_count; v++) {
		const uint32_t row = warm_row_of(warm, warm_key_of(search, lanes->vertex_of[v]));
		int32_t *potential = row == INSTANCE_NONE ? NULL : warm->potential + (size_t)row * warm->stride;
		lanes->row[v] = potential && *potential != WARM_UNKNOWN ? potential : NULL;
	}
}

/* Which lanes are left, and how far they go in the state's dual. Returns how many there are. A lane proves nothing for
 * a vertex that is not in its middle: where the state was prepared with two vertices of one name, its row may be that
 * of the other. */
static uint32_t find_lanes(struct warm_lanes *lanes, const struct search *search)
{
	const struct steiner_warm *warm = lanes->warm;
	const struct instance *instance = &search->instance;
	const int32_t *at_root = warm->potential + (size_t)warm_row_of(warm, warm->root) * warm->stride;
	uint32_t count = 0;
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		const uint32_t v = instance->terminal[t];
		const uint32_t lane = lane_of(warm, warm_key_of(search, lanes->vertex_of[v]));
		const bool is_middle = lane != INSTANCE_NONE && lanes->row[v] && lanes->row[v][lane] == 0;
		lanes->lane_of[t] = is_middle ? lane : INSTANCE_NONE;
		if (lanes->lane_of[t] == INSTANCE_NONE)
			continue;
		lanes->most[lane] = at_root[lane];
		count++;
	}
	return count;
}

static inline int32_t cut_off(int32_t potential, int32_t most)
{
	return potential < most ? potential : most;
}

static bool is_old_root(const struct warm_lanes *lanes, const struct search *search, uint32_t terminal)
{
	const uint32_t v = search->instance.terminal[terminal];
	return warm_key_of(search, lanes->vertex_of[v]) == lanes->warm->root;
}

/* The old root where it is a terminal still, else the terminal that cuts off least. */
static uint32_t choose_root(const struct warm_lanes *lanes, const struct search *search)
{
	uint32_t best = 0;
	int64_t best_value = -1;
	for (uint32_t t = 0; t < search->instance.terminal_count; t++) {
		const int32_t *row = lanes->row[search->instance.terminal[t]];
		int64_t value = 0;
		if (is_old_root(lanes, search, t))
			return t;
		for (uint32_t lane = 0; row && lane < lanes->warm->lane_count; lane++)
			value += cut_off(row[lane], lanes->most[lane]);
		if (value > best_value)
			best = t, best_value = value;
	}
	return best;
}

/* What the potentials of two neighbours take from the arc u -> v and from v -> u. Shares have up to 30 bits, and are
 * summed in halves so that no lane overflows. */
static inline void sum_shares(const int32_t *u, const int32_t *v, const int32_t *most, uint32_t stride, uint64_t sum[2])
{
	vector low[2] = {{0}}, high[2] = {{0}};
	for (uint32_t i = 0; i < stride; i += WARM_LANES) {
		const vector limit = *(const vector *)(most + i);
		vector a = *(const vector *)(u + i), b = *(const vector *)(v + i);
		const vector a_below = a < limit, b_below = b < limit;
		a = (a & a_below) | (limit & ~a_below);
		b = (b & b_below) | (limit & ~b_below);
		const vector difference = a - b, is_back = difference < (vector){0};
		const vector there = difference & ~is_back, back = -difference & is_back;
		low[0] += there & 0xffff, high[0] += there >> 16;
		low[1] += back & 0xffff, high[1] += back >> 16;
	}
	for (uint32_t side = 0; side < 2; side++) {
		sum[side] = 0;
		for (uint32_t i = 0; i < WARM_LANES; i++)
			sum[side] += (uint64_t)(uint32_t)low[side][i] + ((uint64_t)(uint32_t)high[side][i] << 16);
	}
}

/* Takes the lanes' shares from the arcs between vertices with a row. False where an arc does not cost so much. */
static bool take_shares(const struct warm_lanes *lanes, struct search *search, struct dual *dual)
{
	const struct instance *instance = &search->instance;
	const uint32_t stride = lanes->warm->stride;
	search->work += (uint64_t)instance->edge_count * stride / LANES_FOR_A_UNIT;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		const int32_t *row = lanes->row[v];
		for (uint32_t a = instance->first[v]; row && a < instance->first[v + 1]; a++) {
			const uint32_t u = dual->arc[a].tail, back = dual->mate[a];
			uint64_t share[2];
			if (u > v || !lanes->row[u])
				continue;
			sum_shares(lanes->row[u], row, lanes->most, stride, share);
			if (share[0] > dual->arc[a].cost || share[1] > dual->arc[back].cost)
				return false;
			dual->arc[a].cost -= (uint32_t)share[0];
			dual->arc[back].cost -= (uint32_t)share[1];
		}
	}
	return true;
}

/* Gives a lane's potential to a vertex that has none: the mean of its neighbours', as far as the arcs' costs allow.
 * False where they do not. */
static bool place_in_lane(const struct warm_lanes *lanes, struct dual *dual, uint32_t v, uint32_t lane, int32_t *new)
{
	const uint32_t first = dual->instance->first[v], end = dual->instance->first[v + 1];
	const int32_t limit = lanes->most[lane];
	int64_t least = 0, most = limit, sum = 0, count = 0;
	for (uint32_t a = first; a < end; a++) {
		const int32_t *row = lanes->row[dual->arc[a].tail];
		if (!row)
			continue;
		const int64_t p = cut_off(row[lane], limit), low = p - dual->arc[a].cost;
		const int64_t high = p + dual->arc[dual->mate[a]].cost;
		least = low > least ? low : least;
		most = high < most ? high : most;
		sum += p;
		count++;
	}
	if (least > most)
		return false;
	const int64_t mean = count ? sum / count : 0;
	const int32_t p = (int32_t)(mean < least ? least : mean > most ? most : mean);
	for (uint32_t a = first; a < end; a++) {
		const int32_t *row = lanes->row[dual->arc[a].tail];
		const int32_t q = row ? cut_off(row[lane], limit) : p;
		dual->arc[a].cost -= q > p ? (uint32_t)(q - p) : 0;
		dual->arc[dual->mate[a]].cost -= p > q ? (uint32_t)(p - q) : 0;
	}
	new[lane] = p;
	return true;
}

/* Gives rows to the vertices that have none. *gave_up: a lane found no room, and the costs are to be summed anew. */
static enum tw_status place_new(struct warm_lanes *lanes, struct search *search, struct dual *dual, bool *gave_up)
{
	*gave_up = false;
	for (uint32_t v = 0; v < search->instance.vertex_count; v++) {
		if (lanes->row[v])
			continue;
		int32_t *new = ARENA_ZEROED(search->arena, lanes->warm->stride, int32_t);
		if (!new)
			return TW_ERROR_MEMORY;
		for (uint32_t lane = 0; lane < lanes->warm->lane_count; lane++)
			if (lanes->most[lane] && !place_in_lane(lanes, dual, v, lane, new)) {
				lanes->most[lane] = 0;
				*gave_up = true;
			}
		lanes->row[v] = new;
	}
	return TW_OK;
}

/* Cuts the lanes off at the root. */
static void cut_at_root(struct warm_lanes *lanes, const struct search *search, uint32_t root)
{
	const int32_t *at_root = lanes->row[search->instance.terminal[root]];
	for (uint32_t lane = 0; lane < lanes->warm->lane_count; lane++)
		lanes->most[lane] = cut_off(at_root[lane], lanes->most[lane]);
	if (lanes->lane_of[root] != INSTANCE_NONE)
		lanes->most[lanes->lane_of[root]] = 0;
}

static enum tw_status take_all(struct warm_lanes *lanes, struct search *search, struct dual *dual, bool *fits)
{
	bool gave_up = false;
	*fits = take_shares(lanes, search, dual);
	if (!*fits)
		return TW_OK;
	enum tw_status status = place_new(lanes, search, dual, &gave_up);
	if (status != TW_OK || (!gave_up && is_old_root(lanes, search, dual->root)))
		return status;
	cut_at_root(lanes, search, dual->root);
	status = dual_restart(dual, search, dual->root);
	if (status == TW_OK) {
		*fits = take_shares(lanes, search, dual);
		assert(*fits); /* less than before */
	}
	return status;
}

/* Gives the flows of terminals that are gone to those that came, to the nearest by the lane's own potential. */
static void hand_on_flows(struct warm_lanes *lanes, const struct search *search, uint8_t *is_taken)
{
	const struct instance *instance = &search->instance;
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		lanes->flow_of[t] = lanes->lane_of[t];
		if (lanes->lane_of[t] != INSTANCE_NONE)
			is_taken[lanes->lane_of[t]] = 1;
	}
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		const int32_t *row = lanes->row[instance->terminal[t]];
		uint32_t best = INSTANCE_NONE;
		for (uint32_t lane = 0; lane < lanes->warm->lane_count && lanes->flow_of[t] == INSTANCE_NONE; lane++)
			if (!is_taken[lane] && (best == INSTANCE_NONE || row[lane] < row[best]))
				best = lane;
		if (best == INSTANCE_NONE)
			continue;
		lanes->flow_of[t] = best;
		is_taken[best] = 1;
	}
}

enum tw_status warm_lanes_lay(struct warm_lanes *lanes, const struct steiner_warm *warm, struct search *search,
			      struct dual *dual, bool *fits)
{
	*fits = false;
	if (!allocate(lanes, warm, search))
		return TW_ERROR_MEMORY;
	find_rows(lanes, search);
	if (2 * find_lanes(lanes, search) < search->instance.terminal_count)
		return TW_OK;
	const struct dual like = {.root = choose_root(lanes, search), .coarse_shift = warm->coarse_shift};
	enum tw_status status = dual_init_like(dual, search, &like, 0);
	if (status == TW_OK)
		status = take_all(lanes, search, dual, fits);
	for (uint32_t t = 0; status == TW_OK && *fits && t < search->instance.terminal_count; t++)
		if (lanes->lane_of[t] != INSTANCE_NONE)
			dual->bound += dual->value[t] = (uint64_t)lanes->most[lanes->lane_of[t]];
	uint8_t *is_taken = ARENA_ZEROED(search->arena, warm->lane_count, uint8_t);
	if (!is_taken)
		return TW_ERROR_MEMORY;
	if (status == TW_OK && *fits)
		hand_on_flows(lanes, search, is_taken);
	return status;
}

/* Vertices keep their order when an instance shrinks. */
static enum tw_status find_rows_left(const struct warm_lanes *lanes, struct search *search, int32_t ***row)
{
	const uint32_t left = search->instance.vertex_count;
	uint32_t *vertex_of = ARENA_ARRAY(search->arena, left, uint32_t);
	*row = ARENA_ARRAY(search->arena, left, int32_t *);
	if (!vertex_of || !*row)
		return TW_ERROR_MEMORY;
	warm_name_vertices(search, vertex_of);
	for (uint32_t v = 0, old = 0; v < left; v++, old++) {
		while (lanes->vertex_of[old] != vertex_of[v])
			old++;
		(*row)[v] = lanes->row[old];
	}
	return TW_OK;
}

static void make_ball(struct search *search, struct dual *dual, uint32_t terminal, int32_t *const *row, uint32_t lane,
		      int32_t radius)
{
	struct dual_ball ball = {.terminal = terminal, .radius = (uint32_t)radius, .start = dual->member_count};
	for (uint32_t v = 0; v < dual->instance->vertex_count; v++)
		if (row[v][lane] < radius)
			dual->member[ball.start + ball.count++] = (struct dual_member){v, (uint32_t)row[v][lane]};
	dual->member_count += ball.count;
	dual->ball[dual->ball_count] = ball;
	dual_put_back(dual, search, &dual->ball[dual->ball_count++]);
}

enum tw_status warm_lanes_make_balls(const struct warm_lanes *lanes, struct search *search, struct dual *left)
{
	int32_t **row;
	enum tw_status status = find_rows_left(lanes, search, &row);
	for (uint32_t t = 0; status == TW_OK && t < search->instance.terminal_count; t++) {
		const uint32_t lane = lanes->lane_of[t];
		if (lane == INSTANCE_NONE || !lanes->most[lane])
			continue;
		if (!dual_make_room(left))
			return TW_ERROR_MEMORY;
		make_ball(search, left, t, row, lane, lanes->most[lane]);
	}
	return status;
}
