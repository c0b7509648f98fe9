#include "solver/layout/artifacts.h"

#include "solver/drawing/svg.h"

#include <string.h>

/* A file is a text of its own, or a drawing in some format. Adding one is one row, and where need be one function that
 * fills a drawing, or one that writes a format. */
static const struct artifact {
	const char *name;
	const char *media_type;
	void (*write)(const struct layout_result *result, struct text *text);
	void (*draw)(const struct layout_result *result, struct drawing *drawing, struct arena *arena);
	void (*format)(const struct drawing *drawing, struct text *text);
} artifacts[] = {
	{"layout.json", "application/json", .write = write_layout_json},
	{"pattern.svg", "image/svg+xml", .draw = pattern_draw, .format = svg_write},
	{"suit.svg", "image/svg+xml", .draw = suit_draw, .format = svg_write},
};
enum { ARTIFACT_COUNT = sizeof artifacts / sizeof *artifacts };
_Static_assert((int)ARTIFACT_COUNT <= (int)LAYOUT_ARTIFACTS_MAX, "more files than a layout may have artifacts");

static void draw(const struct artifact *artifact, const struct layout_result *result, struct text *text)
{
	struct arena *arena = arena_new(0);
	struct drawing drawing;
	if (arena) {
		artifact->draw(result, &drawing, arena);
		artifact->format(&drawing, text);
	} else {
		text->failed = true;
	}
	arena_free(arena);
}

static enum tw_status write_file(const struct artifact *artifact, const struct layout_result *result,
				 struct arena *arena, struct layout_artifact *file, struct tw_error *error)
{
	struct text text = {0};
	if (artifact->write)
		artifact->write(result, &text);
	else
		draw(artifact, result, &text);
	file->name = artifact->name;
	file->media_type = artifact->media_type;
	return text_take(&text, arena, &file->bytes, &file->size, error);
}

enum tw_status artifacts_write(const struct layout_result *result, struct arena *arena, struct layout_output *output,
			       struct tw_error *error)
{
	const char *wanted = result->input->file;
	enum tw_status status = TW_OK;
	for (size_t a = 0; a < ARTIFACT_COUNT && status == TW_OK; a++)
		if (!wanted || !strcmp(wanted, artifacts[a].name))
			status = write_file(&artifacts[a], result, arena, &output->artifacts[output->artifact_count++],
					    error);
	return status;
}

const char *layout_file_name(uint32_t i)
{
	return i < ARTIFACT_COUNT ? artifacts[i].name : NULL;
}

const char *layout_file_media_type(const char *name)
{
	for (size_t a = 0; a < ARTIFACT_COUNT; a++)
		if (!strcmp(name, artifacts[a].name))
			return artifacts[a].media_type;
	return NULL;
}
