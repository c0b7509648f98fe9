/* A z-buffer: every face that looks at the viewer is filled cell by cell, its shade interpolated from the normals of
 * its vertices (Gouraud), lit from above and beside the viewer. */
#include "solver/pattern/view.h"

#include <string.h>

static const double cells_max = 16e6;

struct painter {
	struct view *view;
	const struct garment *garment;
	const float *light; /* [vertex_count] 0…1 */
};

struct vec2 view_point(const struct view *view, const double point[3], double *depth)
{
	*depth = view->back ? -point[2] : point[2];
	return (struct vec2){view->back ? -point[0] : point[0], point[1]};
}

static const double *position(const struct garment *garment, uint32_t face, uint32_t k)
{
	return &garment->position[3 * (size_t)garment->face_vertex[3 * (size_t)face + k]];
}

/* Sums the faces' normals at their vertices, weighted by area. */
static void sum_normals(const struct garment *garment, float (*normal)[3])
{
	for (uint32_t f = 0; f < garment->face_count; f++) {
		const double *a = position(garment, f, 0), *b = position(garment, f, 1), *c = position(garment, f, 2);
		double u[3], v[3];
		for (int i = 0; i < 3; i++) {
			u[i] = b[i] - a[i];
			v[i] = c[i] - a[i];
		}
		const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
		for (int k = 0; k < 3; k++)
			for (int i = 0; i < 3; i++)
				normal[garment->face_vertex[3 * (size_t)f + (size_t)k]][i] += (float)n[i];
	}
}

/* Half Lambert, which keeps form in the shade; the light comes from the upper left before the viewer. */
static void light_vertices(const struct view *view, uint32_t count, float (*normal)[3], float *light)
{
	const double lamp[3] = {-0.42, 0.55, 0.72};
	for (uint32_t v = 0; v < count; v++) {
		const double n[3] = {(double)normal[v][0], (double)normal[v][1], (double)normal[v][2]};
		double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		double side = view->back ? -1 : 1;
		double cosine = side * n[0] * lamp[0] + n[1] * lamp[1] + side * n[2] * lamp[2];
		double half = length > 0 ? 0.5 + 0.5 * cosine / length : 0;
		light[v] = (float)(half * half);
	}
}

static void find_frame(struct view *view, const struct garment *garment, double cell_mm)
{
	struct vec2 low = {INFINITY, INFINITY}, high = {-INFINITY, -INFINITY};
	for (uint32_t f = 0; f < garment->face_count; f++) {
		for (uint32_t k = 0; k < 3; k++) {
			double depth;
			struct vec2 p = view_point(view, position(garment, f, k), &depth);
			low = (struct vec2){p.x < low.x ? p.x : low.x, p.y < low.y ? p.y : low.y};
			high = (struct vec2){p.x > high.x ? p.x : high.x, p.y > high.y ? p.y : high.y};
		}
	}
	double width = garment->face_count ? high.x - low.x : 1, height = garment->face_count ? high.y - low.y : 1;
	double least = sqrt((width + 1) * (height + 1) / cells_max);
	view->cell_mm = cell_mm > least ? cell_mm : least;
	view->left = garment->face_count ? low.x : 0;
	view->top = garment->face_count ? high.y : 0;
	view->columns = (uint32_t)(width / view->cell_mm) + 2;
	view->rows = (uint32_t)(height / view->cell_mm) + 2;
}

static uint32_t clamp_cell(double at, uint32_t count)
{
	return at < 0 ? 0 : at >= count ? count - 1 : (uint32_t)at;
}

static uint32_t column_of(const struct view *view, double x)
{
	return clamp_cell((x - view->left) / view->cell_mm, view->columns);
}

static uint32_t row_of(const struct view *view, double y)
{
	return clamp_cell((view->top - y) / view->cell_mm, view->rows);
}

static void put(struct view *view, uint32_t column, uint32_t row, double depth, double light)
{
	size_t cell = (size_t)row * view->columns + column;
	if ((float)depth <= view->depth[cell])
		return;
	double shade = 1 + light * (VIEW_SHADES - 1) + 0.5;
	view->depth[cell] = (float)depth;
	view->shade[cell] = (uint8_t)(shade > VIEW_SHADES ? VIEW_SHADES : shade);
}

static void paint_face(const struct painter *painter, uint32_t face)
{
	struct view *view = painter->view;
	struct vec2 p[3];
	double depth[3], light[3];
	for (uint32_t k = 0; k < 3; k++) {
		p[k] = view_point(view, position(painter->garment, face, k), &depth[k]);
		light[k] = (double)painter->light[painter->garment->face_vertex[3 * (size_t)face + k]];
	}
	double area = vec2_cross(vec2_sub(p[1], p[0]), vec2_sub(p[2], p[0]));
	if (!(area > 1e-12))
		return;
	double x0 = fmin(p[0].x, fmin(p[1].x, p[2].x)), x1 = fmax(p[0].x, fmax(p[1].x, p[2].x));
	double y0 = fmin(p[0].y, fmin(p[1].y, p[2].y)), y1 = fmax(p[0].y, fmax(p[1].y, p[2].y));
	for (uint32_t row = row_of(view, y1); row <= row_of(view, y0); row++) {
		for (uint32_t column = column_of(view, x0); column <= column_of(view, x1); column++) {
			struct vec2 q = {view->left + (column + 0.5) * view->cell_mm,
					 view->top - (row + 0.5) * view->cell_mm};
			double w0 = vec2_cross(vec2_sub(p[1], q), vec2_sub(p[2], q)) / area;
			double w1 = vec2_cross(vec2_sub(p[2], q), vec2_sub(p[0], q)) / area, w2 = 1 - w0 - w1;
			if (w0 < 0 || w1 < 0 || w2 < 0)
				continue;
			put(view, column, row, w0 * depth[0] + w1 * depth[1] + w2 * depth[2],
			    w0 * light[0] + w1 * light[1] + w2 * light[2]);
		}
	}
}

enum tw_status view_render(struct view *view, struct arena *arena, const struct garment *garment, bool back,
			   double cell_mm, struct tw_error *error)
{
	*view = (struct view){.back = back};
	find_frame(view, garment, cell_mm);
	size_t cells = (size_t)view->rows * view->columns;
	view->depth = ARENA_ARRAY(arena, cells, float);
	view->shade = ARENA_ZEROED(arena, cells, uint8_t);
	if (!view->depth || !view->shade)
		return tw_fail_memory(error);
	for (size_t i = 0; i < cells; i++)
		view->depth[i] = -INFINITY;
	struct arena_mark mark = arena_mark(arena);
	float(*normal)[3] = arena_zeroed(arena, garment->vertex_count, sizeof *normal);
	float *light = ARENA_ARRAY(arena, garment->vertex_count, float);
	if (!normal || !light)
		return tw_fail_memory(error);
	sum_normals(garment, normal);
	light_vertices(view, garment->vertex_count, normal, light);
	struct painter painter = {view, garment, light};
	for (uint32_t f = 0; f < garment->face_count; f++)
		paint_face(&painter, f);
	arena_release(arena, mark);
	return TW_OK;
}

bool view_sees(const struct view *view, const double point[3], double slack_mm)
{
	double depth;
	struct vec2 p = view_point(view, point, &depth);
	size_t cell = (size_t)row_of(view, p.y) * view->columns + column_of(view, p.x);
	return depth >= (double)view->depth[cell] - slack_mm;
}
