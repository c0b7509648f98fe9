/* For the tests of the solver: random instances of many shapes, and two exact methods so plain that one can believe
 * them. Nothing here shares code with solver/steiner. */
#ifndef TESTS_UNIT_STEINER_ORACLE_H
#define TESTS_UNIT_STEINER_ORACLE_H

#include "solver/graph/graph.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
	CASE_VERTICES = 256,
	CASE_EDGES = 1024,
	CASE_TERMINALS = 256,
	BRUTE_VERTICES = 12,
	DREYFUS_VERTICES = 160,
	DREYFUS_SETS = 1 << 13
};

#define UNREACHED (UINT64_MAX / 4)

struct instance_case {
	uint32_t vertex_count, edge_count, terminal_count;
	uint32_t ends[2 * CASE_EDGES];
	uint64_t weight[CASE_EDGES];
	uint32_t terminal[CASE_TERMINALS];
};

/* splitmix64 (Steele, Lea & Flood 2014) */
static inline uint64_t random_next(uint64_t *state)
{
	uint64_t z = (*state += 0x9e3779b97f4a7c15u);
	z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
	z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
	return z ^ (z >> 31);
}

static inline uint32_t random_below(uint64_t *state, uint32_t n)
{
	return (uint32_t)(random_next(state) % n);
}

static inline void case_edge(struct instance_case *c, uint32_t u, uint32_t v)
{
	if (u == v || c->edge_count == CASE_EDGES)
		return;
	c->ends[2 * c->edge_count] = u;
	c->ends[2 * c->edge_count + 1] = v;
	c->edge_count++;
}

/* --- shapes ----------------------------------------------------------------------------------------------------- */

/* width x height; around: closed to a cylinder (1) or torus (2); diagonals make triangles. */
static inline void shape_grid(struct instance_case *c, uint32_t width, uint32_t height, int around, int diagonals)
{
	c->vertex_count = width * height;
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			const uint32_t v = y * width + x;
			const uint32_t right = y * width + (x + 1) % width, below = (y + 1) % height * width + x;
			const int has_right = x + 1 < width || (around && width > 2);
			const int has_below = y + 1 < height || (around == 2 && height > 2);
			if (has_right)
				case_edge(c, v, right);
			if (has_below)
				case_edge(c, v, below);
			if (diagonals && has_right && has_below)
				case_edge(c, v, (y + 1) % height * width + (x + 1) % width);
		}
}

/* The edges of triangles over side * side vertices, whose last `apart` rows (0 or 1) nothing joins to the others.
 * Returns how many there are; room for 3 * side * side. For meshes larger than a case. */
static inline uint32_t mesh_edges(uint32_t side, uint32_t apart, uint32_t *ends)
{
	uint32_t count = 0;
	for (uint32_t y = 0; y < side; y++)
		for (uint32_t x = 0; x < side; x++) {
			const uint32_t v = y * side + x, next[3] = {v + 1, v + side, v + side + 1};
			const int right = x + 1 < side, below = y + 1 + apart < side;
			const int is_there[3] = {right, below, right && below};
			for (uint32_t i = 0; i < 3; i++) {
				if (!is_there[i])
					continue;
				ends[2 * count] = v;
				ends[2 * count + 1] = next[i];
				count++;
			}
		}
	return count;
}

/* A triangulated sphere: start from a tetrahedron, put vertices into random faces (Apollonian), then flip edges' worth
 * of variety in by taking faces that were split least. All V - E + F = 2. */
static inline void shape_sphere(struct instance_case *c, uint32_t vertices, uint64_t *state)
{
	uint32_t face[2 * CASE_VERTICES][3] = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
	uint32_t faces = 4;
	c->vertex_count = vertices;
	for (uint32_t u = 0; u < 4; u++)
		for (uint32_t v = 0; v < u; v++)
			case_edge(c, u, v);
	for (uint32_t v = 4; v < vertices; v++) {
		uint32_t *f = face[random_below(state, faces)];
		const uint32_t a = f[0], b = f[1], d = f[2];
		case_edge(c, v, a);
		case_edge(c, v, b);
		case_edge(c, v, d);
		f[2] = v;
		memcpy(face[faces++], (uint32_t[3]){a, d, v}, sizeof face[0]);
		memcpy(face[faces++], (uint32_t[3]){b, d, v}, sizeof face[0]);
	}
}

/* A ladder of rings around two poles: a sphere with long thin parts, as a limb is. */
static inline void shape_limb(struct instance_case *c, uint32_t around, uint32_t rings)
{
	c->vertex_count = around * rings + 2;
	for (uint32_t r = 0; r < rings; r++)
		for (uint32_t i = 0; i < around; i++) {
			const uint32_t v = r * around + i, next = r * around + (i + 1) % around;
			case_edge(c, v, next);
			if (r + 1 < rings) {
				case_edge(c, v, v + around);
				case_edge(c, v, next + around);
			}
			if (r == 0)
				case_edge(c, v, around * rings);
			if (r + 1 == rings)
				case_edge(c, v, around * rings + 1);
		}
}

/* Random edges over a random spanning tree (or, one time in sixteen, over a forest). Parallel edges happen. */
static inline void shape_random(struct instance_case *c, uint32_t vertices, uint32_t more, uint64_t *state)
{
	c->vertex_count = vertices;
	const uint32_t apart = random_below(state, 16) ? 0 : 1 + random_below(state, vertices);
	for (uint32_t v = 1; v < vertices; v++)
		if (v != apart)
			case_edge(c, v, random_below(state, v));
	for (uint32_t i = 0; i < more; i++)
		case_edge(c, random_below(state, vertices), random_below(state, vertices));
}

static inline void shape_complete(struct instance_case *c, uint32_t vertices)
{
	c->vertex_count = vertices;
	for (uint32_t v = 1; v < vertices; v++)
		for (uint32_t u = 0; u < v; u++)
			case_edge(c, u, v);
}

/* Drops edges at random, so that faces get larger and some vertices are cut off. */
static inline void thin_out(struct instance_case *c, uint32_t percent, uint64_t *state)
{
	uint32_t kept = 0;
	for (uint32_t e = 0; e < c->edge_count; e++)
		if (random_below(state, 100) >= percent) {
			c->ends[2 * kept] = c->ends[2 * e];
			c->ends[2 * kept + 1] = c->ends[2 * e + 1];
			kept++;
		}
	c->edge_count = kept;
}

enum { WEIGHT_KINDS = 7 };

static inline void weigh(struct instance_case *c, uint32_t kind, uint64_t *state)
{
	for (uint32_t e = 0; e < c->edge_count; e++) {
		const uint64_t r = random_next(state);
		switch (kind) {
		case 0: /* all equal */
			c->weight[e] = 1;
			break;
		case 1: /* zeros and ties */
			c->weight[e] = r % 3;
			break;
		case 2: /* ties */
			c->weight[e] = 1 + r % 4;
			break;
		case 3:
			c->weight[e] = 1 + r % 1000;
			break;
		case 4: /* of very different size */
			c->weight[e] = UINT64_C(1) << r % 20;
			break;
		case 5: /* as large as they may be: all of them sum to just below 62 bits */
			c->weight[e] = r % ((UINT64_C(1) << 62) / c->edge_count);
			break;
		default: /* like a mesh: about equal, no ties */
			c->weight[e] = 10000 + r % 5000;
			break;
		}
	}
}

static inline void place_terminals(struct instance_case *c, uint32_t count, uint64_t *state)
{
	c->terminal_count = count;
	for (uint32_t i = 0; i < count; i++)
		c->terminal[i] = random_below(state, c->vertex_count);
}

/* A random instance of at most 40 vertices and `terminals_max` terminals. */
static inline void case_random(struct instance_case *c, uint32_t terminals_max, uint64_t *state)
{
	c->vertex_count = c->edge_count = 0;
	switch (random_below(state, 9)) {
	case 0:
		shape_grid(c, 2 + random_below(state, 5), 2 + random_below(state, 5), 0, 0);
		break;
	case 1:
		shape_grid(c, 3 + random_below(state, 4), 2 + random_below(state, 4), 0, 1);
		break;
	case 2:
		shape_grid(c, 3 + random_below(state, 4), 2 + random_below(state, 5), 1, (int)random_below(state, 2));
		break;
	case 3:
		shape_grid(c, 3 + random_below(state, 3), 3 + random_below(state, 3), 2, (int)random_below(state, 2));
		break;
	case 4:
		shape_sphere(c, 4 + random_below(state, 24), state);
		break;
	case 5:
		shape_limb(c, 3 + random_below(state, 3), 2 + random_below(state, 5));
		break;
	case 6:
		shape_random(c, 2 + random_below(state, 20), random_below(state, 30), state);
		break;
	case 7:
		shape_complete(c, 2 + random_below(state, 11));
		break;
	default:
		shape_sphere(c, 6 + random_below(state, 20), state);
		thin_out(c, random_below(state, 40), state);
		break;
	}
	weigh(c, random_below(state, WEIGHT_KINDS), state);
	place_terminals(c, 1 + random_below(state, terminals_max), state);
}

/* A mesh of some hundred vertices, on which separators have room to open and close. */
static inline void case_mesh(struct instance_case *c, uint64_t *state)
{
	c->vertex_count = c->edge_count = 0;
	switch (random_below(state, 5)) {
	case 0:
		shape_grid(c, 12, 12, 0, 1);
		break;
	case 1:
		shape_grid(c, 8 + random_below(state, 4), 13, 1, (int)random_below(state, 2));
		break;
	case 2:
		shape_limb(c, 5 + random_below(state, 6), 14);
		break;
	case 3:
		shape_sphere(c, 100 + random_below(state, 50), state);
		break;
	default:
		shape_grid(c, 12, 12, 2, 1);
		break;
	}
	if (!random_below(state, 3))
		thin_out(c, random_below(state, 25), state);
	weigh(c, random_below(state, WEIGHT_KINDS), state);
	place_terminals(c, 3 + random_below(state, 7), state);
}

/* The same problem with other names: vertices, edges and terminals in random order. */
static inline void case_shuffle(struct instance_case *c, uint64_t *state)
{
	uint32_t name[CASE_VERTICES];
	for (uint32_t v = 0; v < c->vertex_count; v++) {
		const uint32_t other = random_below(state, v + 1);
		name[v] = name[other];
		name[other] = v;
	}
	for (uint32_t i = 0; i < 2 * c->edge_count; i++)
		c->ends[i] = name[c->ends[i]];
	for (uint32_t e = c->edge_count; e > 1; e--) {
		const uint32_t a = e - 1, b = random_below(state, e);
		for (uint32_t side = 0; side < 2; side++) {
			const uint32_t end = c->ends[2 * a + side];
			c->ends[2 * a + side] = c->ends[2 * b + side];
			c->ends[2 * b + side] = end;
		}
		const uint64_t weight = c->weight[a];
		c->weight[a] = c->weight[b];
		c->weight[b] = weight;
	}
	for (uint32_t i = 0; i < c->terminal_count; i++)
		c->terminal[i] = name[c->terminal[i]];
	for (uint32_t i = c->terminal_count; i > 1; i--) {
		const uint32_t other = random_below(state, i), terminal = c->terminal[i - 1];
		c->terminal[i - 1] = c->terminal[other];
		c->terminal[other] = terminal;
	}
}

/* --- oracles ---------------------------------------------------------------------------------------------------- */

/* Weight of a minimum spanning tree of the vertices in `mask`, UNREACHED if they are not connected (Prim, by the
 * matrix). */
static inline uint64_t oracle_spanning(uint64_t (*direct)[BRUTE_VERTICES], uint32_t n, uint32_t mask)
{
	uint64_t near[BRUTE_VERTICES], sum = 0;
	uint32_t out = mask;
	for (uint32_t v = 0; v < n; v++)
		near[v] = UNREACHED;
	near[__builtin_ctz(mask)] = 0;
	while (out) {
		uint32_t best = n;
		for (uint32_t v = 0; v < n; v++)
			if ((out >> v & 1) && (best == n || near[v] < near[best]))
				best = v;
		if (near[best] >= UNREACHED)
			return UNREACHED;
		sum += near[best];
		out &= ~(1u << best);
		for (uint32_t v = 0; v < n; v++)
			if (direct[best][v] < near[v])
				near[v] = direct[best][v];
	}
	return sum;
}

/* The optimum by trying every vertex set that holds the terminals; up to BRUTE_VERTICES vertices. */
static inline uint64_t oracle_brute(const struct instance_case *c)
{
	uint64_t direct[BRUTE_VERTICES][BRUTE_VERTICES];
	const uint32_t n = c->vertex_count;
	for (uint32_t u = 0; u < n; u++)
		for (uint32_t v = 0; v < n; v++)
			direct[u][v] = UNREACHED;
	for (uint32_t e = 0; e < c->edge_count; e++) {
		const uint32_t u = c->ends[2 * e], v = c->ends[2 * e + 1];
		if (c->weight[e] < direct[u][v])
			direct[u][v] = direct[v][u] = c->weight[e];
	}
	uint32_t needed = 0;
	for (uint32_t i = 0; i < c->terminal_count; i++)
		needed |= 1u << c->terminal[i];
	uint64_t best = UNREACHED;
	for (uint32_t mask = 0; mask < 1u << n; mask++)
		if ((mask & needed) == needed) {
			const uint64_t sum = oracle_spanning(direct, n, mask);
			if (sum < best)
				best = sum;
		}
	return best;
}

/* The optimum by Dreyfus & Wagner (1971), from all distances (Floyd & Warshall); up to DREYFUS_VERTICES vertices and 14
 * terminals. cost[set][v]: the lightest tree that spans the terminals of the set and v. */
static inline uint64_t oracle_dreyfus(const struct instance_case *c)
{
	static uint64_t distance[DREYFUS_VERTICES][DREYFUS_VERTICES], cost[DREYFUS_SETS][DREYFUS_VERTICES];
	const uint32_t n = c->vertex_count, last = c->terminal_count - 1;
	for (uint32_t u = 0; u < n; u++)
		for (uint32_t v = 0; v < n; v++)
			distance[u][v] = u == v ? 0 : UNREACHED;
	for (uint32_t e = 0; e < c->edge_count; e++) {
		const uint32_t u = c->ends[2 * e], v = c->ends[2 * e + 1];
		if (c->weight[e] < distance[u][v])
			distance[u][v] = distance[v][u] = c->weight[e];
	}
	for (uint32_t w = 0; w < n; w++)
		for (uint32_t u = 0; u < n; u++) {
			const uint64_t to = distance[u][w];
			if (to >= UNREACHED)
				continue;
			for (uint32_t v = 0; v < n; v++)
				if (to + distance[w][v] < distance[u][v])
					distance[u][v] = to + distance[w][v];
		}
	for (uint32_t set = 1; set < 1u << last; set++) {
		uint64_t joined[DREYFUS_VERTICES];
		for (uint32_t v = 0; v < n; v++)
			joined[v] = set & (set - 1) ? UNREACHED : distance[c->terminal[__builtin_ctz(set)]][v];
		for (uint32_t part = (set - 1) & set; part > (set ^ part); part = (part - 1) & set)
			for (uint32_t v = 0; v < n; v++)
				if (cost[part][v] + cost[set ^ part][v] < joined[v])
					joined[v] = cost[part][v] + cost[set ^ part][v];
		for (uint32_t v = 0; v < n; v++) {
			uint64_t best = UNREACHED;
			for (uint32_t u = 0; u < n; u++)
				if (joined[u] + distance[u][v] < best)
					best = joined[u] + distance[u][v];
			cost[set][v] = best;
		}
	}
	return last ? cost[(1u << last) - 1][c->terminal[last]] : 0;
}

#endif
