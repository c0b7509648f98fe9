/* The job that makes a layout: the field and the request to the solver, its figures back, and the trees, of which
 * drawings are made when somebody asks for them (job_draw.c). */
#include "service/worker/layout_work.h"
#include "service/worker/motion_means.h"
#include "service/worker/motion_source.h"
#include "solver/steiner/warm/warm.h"

#include <stdlib.h>
#include <string.h>

/* What the search of a drag leaves for the next one: prepared when the answer is out, because that takes longer than
 * the answer. */
struct drag {
	struct steiner_warm *warm; /* borrowed */
	bool is_first;             /* this is the first job of the drag that comes to this worker */
	struct layout_found found;
};

static void tell_progress(void *context, const struct layout_progress *progress)
{
	struct layout_work *layout = context;
	char *partial = NULL;
	json_t *json = progress->weight == UINT64_MAX ? NULL : json_object();
	if (json && layout_bounds_add(json, progress->weight, progress->lower_bound, progress->energy_scale))
		partial = json_dumps(json, JSON_COMPACT);
	json_decref(json);
	pulse_tell(layout->work->pulse, progress->share, progress->stage, partial);
	free(partial);
}

static enum tw_status open_motion(void *context, uint32_t motion, struct motion_reader **reader, struct tw_error *error)
{
	struct layout_work *layout = context;
	blob_source_clear(&layout->source);
	return motion_source_open(reader, &layout->source, layout->work->store, layout->mesh,
				  layout->motion_ids[motion], error);
}

static enum tw_status read_mean(void *context, uint32_t motion, double *density, struct tw_error *error)
{
	struct layout_work *layout = context;
	struct arena *arena = layout->work->arena;
	struct arena_mark mark = arena_mark(arena);
	double *mean = NULL;
	enum tw_status status =
		motion_mean(layout->work, layout->mesh, layout->motion_ids[motion], &layout->field->field.options,
			    layout->field->version, 0.9, 0.9, &mean, error);
	if (status == TW_OK)
		memcpy(density, mean, layout->mesh->garment.face_count * sizeof *density);
	arena_release(arena, mark);
	return status;
}

static enum tw_status take_output(struct work *work, const struct layout_output *output, struct tw_error *error)
{
	struct tw_array *trees = ARENA_ARRAY(work->arena, 1, struct tw_array);
	if (!trees)
		return tw_fail_memory(error);
	enum tw_status status = layout_work_take_files(work, output, error);
	if (status == TW_OK)
		status = trees_to_array(&output->trees, work->arena, trees, error);
	trees->name = job_kind_row(JOB_DRAW)->source;
	work->result.arrays = trees;
	work->result.array_count = 1;
	return status == TW_OK ? work_summary(work, layout_summary_show(&output->summary), error) : status;
}

static bool is_wanted(void *context)
{
	const struct work *work = context;
	return work->is_wanted(work->wanted_context);
}

static bool must_stop(void *context)
{
	const struct work *work = context;
	return work->stop && work->stop();
}

/* A refresh, or a state that may never be of use, gives way to whatever is queued. But a second job of a drag says that
 * there will be a third, and while none of them finds a state, all are slow. */
static void prepare_next(struct work *work)
{
	struct drag *drag = work->left;
	const bool gives_way = drag->is_first || steiner_warm_is_ready(drag->warm);
	drag->found.options.cancelled = gives_way ? is_wanted : must_stop;
	drag->found.options.context = work;
	const enum tw_status status =
		steiner_warm_prepare(drag->warm, &drag->found.graph, drag->found.terminal, drag->found.terminal_count,
				     &drag->found.options, &drag->found.tree);
	if (status == TW_OK)
		warm_states_settle(work->warm_states);
}

/* *drag lies in the job's arena; NULL where the job is in none. */
static enum tw_status join_drag(struct work *work, struct drag **drag, struct tw_error *error)
{
	*drag = NULL;
	if (!work->affinity)
		return TW_OK;
	*drag = ARENA_ZEROED(work->arena, 1, struct drag);
	if (!*drag)
		return tw_fail_memory(error);
	(*drag)->warm = warm_states_get(work->warm_states, work->affinity, &(*drag)->is_first);
	return (*drag)->warm ? TW_OK : tw_fail_memory(error);
}

static void leave_drag(struct work *work, struct drag *drag, const struct layout_output *output)
{
	if (!drag || !steiner_warm_is_due(drag->warm) || !output->found.tree.is_unique)
		return;
	drag->found = output->found;
	work->later = prepare_next;
	work->left = drag;
}

static enum tw_status compute(struct layout_work *layout, const struct layout_request *request, struct tw_error *error)
{
	struct drag *drag = NULL;
	enum tw_status status = join_drag(layout->work, &drag, error);
	if (status != TW_OK)
		return status;
	struct layout_output output;
	struct layout_input input = layout_work_input(layout);
	input.request = request;
	input.file = layout_file_name(0);
	input.motion_name = layout->motion_names;
	input.motion_count = (uint32_t)layout->motion_count;
	input.motion_has_frames = layout->motion_has_frames;
	input.motion_open = open_motion;
	input.motion_mean = read_mean;
	input.progress = tell_progress;
	input.warm = drag ? drag->warm : NULL;
	status = layout_compute(&input, layout->work->arena, &output, error);
	if (status == TW_OK)
		leave_drag(layout->work, drag, &output);
	return status == TW_OK ? take_output(layout->work, &output, error) : status;
}

enum tw_status job_compute_layout(struct work *work, struct tw_error *error)
{
	struct layout_work layout = {.work = work};
	struct layout_request request;
	const char *text = work->resource->options;
	enum tw_status status = layout_request_parse(&request, text, strlen(text), error);
	if (status != TW_OK)
		return status;
	status = work_step(work, 0, "loading", error);
	if (status == TW_OK)
		status = layout_work_load(&layout, work, work->resource->id, error);
	if (status == TW_OK)
		status = layout_work_load_motions(&layout, error);
	if (status == TW_OK)
		status = compute(&layout, &request, error);
	layout_work_clear(&layout);
	layout_request_clear(&request);
	return status;
}
