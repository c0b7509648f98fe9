/* The job that makes a drawing of a layout that is there: from its trees, without a search, the bytes that would have
 * been made with it. */
#include "service/worker/layout_work.h"

#include <string.h>

static enum tw_status read_trees(struct work *work, struct layout_trees *trees, struct tw_error *error)
{
	struct tw_array *arrays = NULL;
	size_t count = 0;
	enum tw_status status = cache_read_arrays(work->arena, work->store, work->resource->id, &arrays, &count, error);
	for (size_t i = 0; status == TW_OK && i < count; i++)
		if (!strcmp(arrays[i].name, job_kind_row(JOB_DRAW)->source))
			return trees_from_array(trees, work->arena, &arrays[i], error);
	return status != TW_OK ? status
			       : tw_fail(error, TW_ERROR_INTERNAL, "store-damaged", NULL,
					 "the layout's trees are not in the store");
}

static enum tw_status draw(struct layout_work *layout, const struct layout_request *request,
			   const struct layout_trees *trees, struct tw_error *error)
{
	struct layout_output output;
	struct layout_input input = layout_work_input(layout);
	input.request = request;
	input.trees = trees;
	input.file = layout->work->argument;
	enum tw_status status = layout_compute(&input, layout->work->arena, &output, error);
	return status == TW_OK ? layout_work_take_files(layout->work, &output, error) : status;
}

enum tw_status job_draw(struct work *work, struct tw_error *error)
{
	struct layout_work layout = {.work = work};
	struct layout_request request;
	struct layout_trees trees;
	const char *text = work->resource->options;
	enum tw_status status = layout_request_parse(&request, text, strlen(text), error);
	if (status != TW_OK)
		return status;
	status = work_step(work, 0, "loading", error);
	if (status == TW_OK)
		status = read_trees(work, &trees, error);
	if (status == TW_OK)
		status = layout_work_load(&layout, work, work->resource->id, error);
	if (status == TW_OK)
		status = work_step(work, 0.3, "drawing", error);
	if (status == TW_OK)
		status = draw(&layout, &request, &trees, error);
	layout_work_clear(&layout);
	layout_request_clear(&request);
	return status;
}
