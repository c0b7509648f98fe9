#include "solver/drawing/drawing.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { FIRST_ROOM = 8 }; /* vertices of a new path */

void drawing_begin_layer(struct drawing *drawing, const char *id, const char *label)
{
	struct drawing_layer *layer = ARENA_ARRAY(drawing->arena, 1, struct drawing_layer);
	if (!layer) {
		drawing->failed = true;
		return;
	}
	*layer = (struct drawing_layer){.id = id, .label = label};
	if (drawing->last)
		drawing->last->next = layer;
	else
		drawing->first = layer;
	drawing->last = layer;
}

static struct drawing_item *add_item(struct drawing *drawing, const struct drawing_item *item)
{
	struct drawing_layer *layer = drawing->last;
	assert(layer || drawing->failed);
	struct drawing_item *fresh = layer ? ARENA_ARRAY(drawing->arena, 1, struct drawing_item) : NULL;
	if (!fresh) {
		drawing->failed = true;
		return NULL;
	}
	*fresh = *item;
	if (layer->last)
		layer->last->next = fresh;
	else
		layer->first = fresh;
	layer->last = fresh;
	return fresh;
}

struct drawing_item *drawing_add_path(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
				      bool closed)
{
	return add_item(drawing, &(struct drawing_item){
					 .kind = DRAWING_PATH, .style = style, .block = block, .path.closed = closed});
}

struct drawing_item *drawing_add_circle(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
					struct vec2 centre, double radius)
{
	return add_item(drawing, &(struct drawing_item){.kind = DRAWING_CIRCLE,
							.style = style,
							.block = block,
							.circle = {.centre = centre, .radius = radius}});
}

struct drawing_item *drawing_add_text(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
				      const struct drawing_text *text)
{
	if (!text->text) {
		drawing->failed = true;
		return NULL;
	}
	return add_item(drawing,
			&(struct drawing_item){.kind = DRAWING_TEXT, .style = style, .block = block, .text = *text});
}

struct drawing_item *drawing_add_cells(struct drawing *drawing, const struct drawing_cells *cells)
{
	return add_item(drawing, &(struct drawing_item){.kind = DRAWING_CELLS, .block = DRAWING_NONE, .cells = *cells});
}

void drawing_add_line(struct drawing *drawing, const struct drawing_style *style, uint32_t block, struct vec2 from,
		      struct vec2 to)
{
	struct drawing_item *path = drawing_add_path(drawing, style, block, false);
	drawing_move_to(drawing, path, from);
	drawing_line_to(drawing, path, to);
}

static void add_vertex(struct drawing *drawing, struct drawing_item *item, struct vec2 at, bool begins)
{
	if (!item)
		return;
	assert(item->kind == DRAWING_PATH);
	assert(begins || item->path.count);
	struct drawing_path *path = &item->path;
	if (path->count == path->room) {
		uint32_t room = path->room ? 2 * path->room : FIRST_ROOM;
		struct drawing_vertex *vertex = ARENA_ARRAY(drawing->arena, room, struct drawing_vertex);
		if (!vertex || room <= path->room) {
			drawing->failed = true;
			return;
		}
		if (path->count)
			memcpy(vertex, path->vertex, path->count * sizeof *vertex);
		path->vertex = vertex;
		path->room = room;
	}
	path->vertex[path->count++] = (struct drawing_vertex){.at = at, .begins = begins};
}

void drawing_move_to(struct drawing *drawing, struct drawing_item *path, struct vec2 at)
{
	add_vertex(drawing, path, at, true);
}

void drawing_line_to(struct drawing *drawing, struct drawing_item *path, struct vec2 to)
{
	add_vertex(drawing, path, to, false);
}

void drawing_arc_to(struct drawing *drawing, struct drawing_item *path, struct vec2 to, double turn)
{
	if (path && path->path.count) {
		assert(fabs(turn) < 2 * CURVE_PI);
		struct vec2 quarter = vec2_of_angle(turn / 4);
		path->path.vertex[path->path.count - 1].bulge = quarter.y / quarter.x;
	}
	add_vertex(drawing, path, to, false);
}

void drawing_set_title(struct drawing_item *item, const char *title)
{
	if (item)
		item->title = title;
}

const char *drawing_format(struct drawing *drawing, const char *format, ...)
{
	va_list arguments, again;
	va_start(arguments, format);
	va_copy(again, arguments);
	int length = vsnprintf(NULL, 0, format, arguments);
	va_end(arguments);
	char *text = length < 0 ? NULL : ARENA_ARRAY(drawing->arena, (size_t)length + 1, char);
	if (text)
		vsnprintf(text, (size_t)length + 1, format, again);
	else
		drawing->failed = true;
	va_end(again);
	return text;
}
