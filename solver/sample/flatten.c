/* Every triangle is laid in a plane of its own and shrunk to the cloth's size. Then, in turn: each triangle's best
 * rotation onto the present layout (closed form, no angles), and the layout that fits all rotated triangles best (a
 * Laplace system, the same in every round). The system is factored once, by a banded Cholesky: with the vertices
 * ordered upwards the band is about two rows of the piece wide. */
#include "solver/sample/flatten.h"

#include "solver/sample/surface.h"

#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 400 };

/* mm; the layout is done when no vertex moves farther in a round. */
static const double still = 2e-3;

struct layout {
	const struct flatten_piece *piece;
	uint32_t *order;      /* [vertex] its row */
	double (*rest)[3][2]; /* [face] the shrunken triangle's edges, side by side */
	double (*weight)[3];  /* [face] half the cotangent opposite each side */
	double *factor;       /* [row][band + 1] lower triangle, the diagonal last */
	uint32_t band;
	double (*point)[2]; /* [row] */
	double (*right)[2]; /* [row] right-hand side */
};

struct height {
	double height;
	uint32_t vertex;
};

static int height_compare(const void *left, const void *right)
{
	const struct height *a = left, *b = right;
	if (a->height != b->height)
		return a->height < b->height ? -1 : 1;
	return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

static bool order_upwards(struct layout *layout, struct arena *arena)
{
	const struct flatten_piece *piece = layout->piece;
	struct height *height = ARENA_ARRAY(arena, piece->vertex_count, struct height);
	if (!height)
		return false;
	for (uint32_t v = 0; v < piece->vertex_count; v++)
		height[v] = (struct height){vec3_dot(piece->position[v], piece->upward), v};
	qsort(height, piece->vertex_count, sizeof *height, height_compare);
	for (uint32_t i = 0; i < piece->vertex_count; i++)
		layout->order[height[i].vertex] = i;
	return true;
}

/* The edges of a triangle in its own plane, shrunk: by `girth` across and `length` along the upward direction. */
static void rest_edges(const struct flatten_piece *piece, uint32_t face, double rest[3][2])
{
	const uint32_t *corner = piece->corner[face];
	struct vec3 p[3];
	for (int k = 0; k < 3; k++)
		p[k] = piece->position[corner[k]];
	struct vec3 normal = vec3_unit(vec3_normal(p[0], p[1], p[2]));
	struct vec3 x = vec3_unit(vec3_sub(p[1], p[0])), y = vec3_cross(normal, x);
	double up[2] = {vec3_dot(piece->upward, x), vec3_dot(piece->upward, y)};
	for (int k = 0; k < 3; k++) {
		struct vec3 edge = vec3_sub(p[corner_next(k)], p[k]);
		double e[2] = {vec3_dot(edge, x), vec3_dot(edge, y)};
		double along = (piece->length - piece->girth) * (e[0] * up[0] + e[1] * up[1]);
		rest[k][0] = piece->girth * e[0] + along * up[0];
		rest[k][1] = piece->girth * e[1] + along * up[1];
	}
}

static void rest_init(struct layout *layout)
{
	for (uint32_t f = 0; f < layout->piece->face_count; f++) {
		double(*rest)[2] = layout->rest[f];
		rest_edges(layout->piece, f, rest);
		double twice_area = rest[0][0] * rest[1][1] - rest[0][1] * rest[1][0];
		for (int k = 0; k < 3; k++) {
			const double *a = rest[corner_next(k)], *b = rest[corner_next(corner_next(k))];
			double weight = -0.5 * (a[0] * b[0] + a[1] * b[1]) / twice_area;
			layout->weight[f][k] = weight > 0.02 ? weight : 0.02;
		}
	}
}

static bool factor_init(struct layout *layout, struct arena *arena)
{
	const struct flatten_piece *piece = layout->piece;
	uint32_t n = piece->vertex_count, band = 0;
	for (uint32_t f = 0; f < piece->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = layout->order[piece->corner[f][k]],
				 b = layout->order[piece->corner[f][corner_next(k)]];
			uint32_t apart = a > b ? a - b : b - a;
			band = apart > band ? apart : band;
		}
	layout->band = band;
	size_t stride = (size_t)band + 1;
	double *m = layout->factor = ARENA_ZEROED(arena, n * stride, double);
	if (!m)
		return false;
	for (uint32_t f = 0; f < piece->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = layout->order[piece->corner[f][k]],
				 b = layout->order[piece->corner[f][corner_next(k)]];
			double w = layout->weight[f][k];
			m[a * stride + band] += w;
			m[b * stride + band] += w;
			uint32_t row = a > b ? a : b, column = a > b ? b : a;
			m[row * stride + band - (row - column)] -= w;
		}
	m[band] += 1; /* the first vertex stays: the system knows differences only */
	return true;
}

/* Replaces the matrix by its Cholesky factor. Column c of row r is at [r * stride + band - (r - c)]. */
static void factorize(struct layout *layout)
{
	uint32_t n = layout->piece->vertex_count, band = layout->band;
	size_t stride = (size_t)band + 1;
	double *m = layout->factor;
	for (uint32_t r = 0; r < n; r++) {
		uint32_t first = r > band ? r - band : 0;
		double *row = m + r * stride + band - r; /* row[c] */
		for (uint32_t c = first; c <= r; c++) {
			const double *other = m + c * stride + band - c;
			uint32_t from = c > band && c - band > first ? c - band : first;
			double sum = row[c];
			for (uint32_t j = from; j < c; j++)
				sum -= row[j] * other[j];
			row[c] = c < r ? sum / other[c] : sqrt(sum > 1e-12 ? sum : 1e-12);
		}
	}
}

/* right := the solution, both columns at once. */
static void solve(struct layout *layout)
{
	uint32_t n = layout->piece->vertex_count, band = layout->band;
	size_t stride = (size_t)band + 1;
	double(*b)[2] = layout->right;
	for (uint32_t r = 0; r < n; r++) {
		const double *row = layout->factor + r * stride + band - r;
		double x = b[r][0], y = b[r][1];
		for (uint32_t c = r > band ? r - band : 0; c < r; c++) {
			x -= row[c] * b[c][0];
			y -= row[c] * b[c][1];
		}
		b[r][0] = x / row[r];
		b[r][1] = y / row[r];
	}
	for (uint32_t r = n; r-- > 0;) {
		const double *row = layout->factor + r * stride + band - r;
		b[r][0] /= row[r];
		b[r][1] /= row[r];
		for (uint32_t c = r > band ? r - band : 0; c < r; c++) {
			b[c][0] -= row[c] * b[r][0];
			b[c][1] -= row[c] * b[r][1];
		}
	}
}

/* Cosine and sine, times a positive factor, of the rotation that best turns the rest triangle to the layout. */
static void best_rotation(const struct layout *layout, uint32_t face, double *cosine, double *sine)
{
	const uint32_t *corner = layout->piece->corner[face];
	double c = 0, s = 0;
	for (int k = 0; k < 3; k++) {
		const double *a = layout->point[layout->order[corner[k]]];
		const double *b = layout->point[layout->order[corner[corner_next(k)]]];
		const double *e = layout->rest[face][k];
		double w = layout->weight[face][k], x = b[0] - a[0], y = b[1] - a[1];
		c += w * (e[0] * x + e[1] * y);
		s += w * (e[0] * y - e[1] * x);
	}
	*cosine = c;
	*sine = s;
}

static void gather(struct layout *layout)
{
	const struct flatten_piece *piece = layout->piece;
	memset(layout->right, 0, piece->vertex_count * sizeof *layout->right);
	for (uint32_t f = 0; f < piece->face_count; f++) {
		double c, s;
		best_rotation(layout, f, &c, &s);
		double size = sqrt(c * c + s * s);
		c = size > 0 ? c / size : 1;
		s = size > 0 ? s / size : 0;
		for (int k = 0; k < 3; k++) {
			const double *e = layout->rest[f][k];
			double w = layout->weight[f][k];
			double x = w * (c * e[0] - s * e[1]), y = w * (s * e[0] + c * e[1]);
			double *a = layout->right[layout->order[piece->corner[f][k]]];
			double *b = layout->right[layout->order[piece->corner[f][corner_next(k)]]];
			a[0] -= x;
			a[1] -= y;
			b[0] += x;
			b[1] += y;
		}
	}
	layout->right[0][0] += layout->point[0][0];
	layout->right[0][1] += layout->point[0][1];
}

/* Seen from outside, along the mean normal. */
static void project(struct layout *layout)
{
	const struct flatten_piece *piece = layout->piece;
	struct vec3 normal = {0, 0, 0};
	for (uint32_t f = 0; f < piece->face_count; f++) {
		const uint32_t *c = piece->corner[f];
		normal = vec3_add(normal,
				  vec3_normal(piece->position[c[0]], piece->position[c[1]], piece->position[c[2]]));
	}
	struct vec3 across = vec3_unit(vec3_cross(piece->upward, normal));
	for (uint32_t v = 0; v < piece->vertex_count; v++) {
		double *point = layout->point[layout->order[v]];
		point[0] = vec3_dot(piece->position[v], across) * piece->girth;
		point[1] = vec3_dot(piece->position[v], piece->upward) * piece->length;
	}
}

static void iterate(struct layout *layout)
{
	uint32_t n = layout->piece->vertex_count;
	for (int round = 0; round < ROUNDS; round++) {
		gather(layout);
		solve(layout);
		double farthest = 0;
		for (uint32_t r = 0; r < n; r++) {
			double x = layout->right[r][0] - layout->point[r][0],
			       y = layout->right[r][1] - layout->point[r][1];
			farthest = x * x + y * y > farthest ? x * x + y * y : farthest;
		}
		memcpy(layout->point, layout->right, n * sizeof *layout->point);
		if (farthest < still * still)
			break;
	}
}

/* Turns the piece so that its own triangles' upward directions point up on average, and moves its box to (0, 0). */
static void stand_upright(const struct layout *layout, double (*flat)[2])
{
	const struct flatten_piece *piece = layout->piece;
	double up[2] = {0, 0}, low[2] = {1e9, 1e9};
	for (uint32_t f = 0; f < piece->face_count; f++) {
		const uint32_t *corner = piece->corner[f];
		struct vec3 p = piece->position[corner[0]];
		struct vec3 q = piece->position[corner[1]], r = piece->position[corner[2]];
		struct vec3 normal = vec3_unit(vec3_normal(p, q, r));
		struct vec3 x = vec3_unit(vec3_sub(q, p)), y = vec3_cross(normal, x);
		double c, s, u = vec3_dot(piece->upward, x), v = vec3_dot(piece->upward, y);
		best_rotation(layout, f, &c, &s);
		up[0] += c * u - s * v;
		up[1] += s * u + c * v;
	}
	double size = sqrt(up[0] * up[0] + up[1] * up[1]), c = up[1] / size, s = up[0] / size;
	for (uint32_t v = 0; v < piece->vertex_count; v++) {
		const double *point = layout->point[layout->order[v]];
		flat[v][0] = c * point[0] - s * point[1];
		flat[v][1] = s * point[0] + c * point[1];
		for (int k = 0; k < 2; k++)
			low[k] = flat[v][k] < low[k] ? flat[v][k] : low[k];
	}
	for (uint32_t v = 0; v < piece->vertex_count; v++)
		for (int k = 0; k < 2; k++)
			flat[v][k] -= low[k];
}

bool flatten_piece(double (*flat)[2], struct arena *arena, const struct flatten_piece *piece)
{
	struct arena_mark mark = arena_mark(arena);
	struct layout layout = {.piece = piece};
	layout.order = ARENA_ARRAY(arena, piece->vertex_count, uint32_t);
	layout.rest = arena_array(arena, piece->face_count, sizeof *layout.rest);
	layout.weight = arena_array(arena, piece->face_count, sizeof *layout.weight);
	layout.point = arena_array(arena, piece->vertex_count, sizeof *layout.point);
	layout.right = arena_array(arena, piece->vertex_count, sizeof *layout.right);
	bool done = layout.order && layout.rest && layout.weight && layout.point && layout.right &&
		    order_upwards(&layout, arena);
	if (done) {
		rest_init(&layout);
		done = factor_init(&layout, arena);
	}
	if (done) {
		factorize(&layout);
		project(&layout);
		iterate(&layout);
		stand_upright(&layout, flat);
	}
	arena_release(arena, mark);
	return done;
}
