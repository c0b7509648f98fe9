/* The job that makes a layout: the field and the request to the solver, its artifacts back. */
#include "service/worker/motion_means.h"
#include "service/worker/motion_source.h"
#include "service/worker/work.h"
#include "solver/layout/layout.h"
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

/* The motions are the field's. */
struct layout_work {
	struct work *work;
	const struct cached_mesh *mesh;
	const struct cached_field *field;
	const struct layout_base *base;    /* NULL where it does not fit the cache */
	char (*motion_ids)[STORE_ID_SIZE]; /* owned */
	const char **motion_names;         /* owned list of owned names */
	bool *motion_has_frames;           /* owned */
	size_t motion_count;
	struct drag *drag;         /* in the job's arena; NULL where the job is in none */
	struct blob_source source; /* of the motion that is open; cleared when the next is opened */
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

static bool is_cancelled(void *context)
{
	struct layout_work *layout = context;
	return work_is_stopped(layout->work);
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

/* Motions of which no frames were kept have shaped the field, but cannot show how the wires stretch. */
static enum tw_status find_motions_with_frames(struct layout_work *layout, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	layout->motion_has_frames = calloc(layout->motion_count + 1, sizeof *layout->motion_has_frames);
	if (!layout->motion_has_frames)
		return tw_fail_memory(error);
	for (size_t i = 0; i < layout->motion_count && status == TW_OK; i++)
		status = motion_has_frames(layout->work->store, layout->motion_ids[i], &layout->motion_has_frames[i],
					   error);
	return status;
}

static enum tw_status read_motion_names(struct layout_work *layout, struct tw_error *error)
{
	layout->motion_names = calloc(layout->motion_count + 1, sizeof *layout->motion_names);
	if (!layout->motion_names)
		return tw_fail_memory(error);
	for (size_t i = 0; i < layout->motion_count; i++) {
		struct resource motion;
		enum tw_status status = resource_get(layout->work->store, TENANT_ANY, RESOURCE_MOTION,
						     layout->motion_ids[i], &motion, error);
		if (status != TW_OK)
			return status;
		layout->motion_names[i] = motion.name;
		motion.name = NULL;
		resource_clear(&motion);
	}
	return TW_OK;
}

static void clear(struct layout_work *layout)
{
	for (size_t i = 0; layout->motion_names && i < layout->motion_count; i++)
		free((char *)layout->motion_names[i]);
	free(layout->motion_names);
	free(layout->motion_has_frames);
	free(layout->motion_ids);
	blob_source_clear(&layout->source);
}

static enum tw_status take_output(struct work *work, const struct layout_output *output, struct tw_error *error)
{
	struct job_artifact *artifacts = ARENA_ARRAY(work->arena, output->artifact_count, struct job_artifact);
	if (!artifacts)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < output->artifact_count; i++) {
		const struct layout_artifact *from = &output->artifacts[i];
		artifacts[i] = (struct job_artifact){from->name, from->media_type, from->bytes, from->size};
	}
	work->result.artifacts = artifacts;
	work->result.artifact_count = output->artifact_count;
	return work_summary(work, layout_summary_show(&output->summary), error);
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

static enum tw_status join_drag(struct layout_work *layout, struct tw_error *error)
{
	struct work *work = layout->work;
	if (!work->affinity)
		return TW_OK;
	layout->drag = ARENA_ZEROED(work->arena, 1, struct drag);
	if (!layout->drag)
		return tw_fail_memory(error);
	layout->drag->warm = warm_states_get(work->warm_states, work->affinity, &layout->drag->is_first);
	return layout->drag->warm ? TW_OK : tw_fail_memory(error);
}

static void leave_drag(struct layout_work *layout, const struct layout_output *output)
{
	struct work *work = layout->work;
	if (!layout->drag || !steiner_warm_is_due(layout->drag->warm) || !output->found.tree.is_unique)
		return;
	layout->drag->found = output->found;
	work->later = prepare_next;
	work->left = layout->drag;
}

static enum tw_status compute(struct layout_work *layout, const struct layout_request *request, struct tw_error *error)
{
	struct work *work = layout->work;
	struct layout_output output;
	struct layout_input input = {
		.garment = &layout->mesh->garment,
		.topology = &layout->mesh->topology,
		.field = &layout->field->field,
		.base = layout->base,
		.request = request,
		.motion_name = layout->motion_names,
		.motion_count = (uint32_t)layout->motion_count,
		.motion_has_frames = layout->motion_has_frames,
		.threads = work->threads,
		.warm = layout->drag ? layout->drag->warm : NULL,
		.memory_limit = work->search_limit,
		.motion_open = open_motion,
		.motion_mean = read_mean,
		.progress = tell_progress,
		.cancelled = is_cancelled,
		.context = layout,
	};
	enum tw_status status = layout_compute(&input, work->arena, &output, error);
	if (status == TW_OK)
		leave_drag(layout, &output);
	return status == TW_OK ? take_output(work, &output, error) : status;
}

/* Loads mesh, field and motions of the one field that the layout is made from. */
static enum tw_status load(struct layout_work *layout, struct tw_error *error)
{
	struct work *work = layout->work;
	char(*fields)[STORE_ID_SIZE] = NULL;
	char mesh_id[STORE_ID_SIZE];
	size_t count = 0;
	enum tw_status status = resource_needs(work->store, work->resource->id, RESOURCE_FIELD, &fields, &count, error);
	if (status == TW_OK && count != 1)
		status = tw_fail(error, TW_ERROR_INPUT, "one-field", NULL, "a layout is made from one field, not %zu",
				 count);
	if (status == TW_OK)
		status = work_find_mesh(work, fields[0], mesh_id, error);
	if (status == TW_OK)
		status = cache_mesh(work->cache, work->store, mesh_id, &layout->mesh, error);
	if (status == TW_OK)
		status = cache_field(work->cache, work->store, fields[0], layout->mesh, &layout->field, error);
	if (status == TW_OK)
		status = cache_base(work->cache, layout->mesh, layout->field, &layout->base, error);
	if (status == TW_OK)
		status = resource_needs(work->store, fields[0], RESOURCE_MOTION, &layout->motion_ids,
					&layout->motion_count, error);
	free(fields);
	if (status == TW_OK)
		status = find_motions_with_frames(layout, error);
	return status == TW_OK ? read_motion_names(layout, error) : status;
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
		status = load(&layout, error);
	if (status == TW_OK)
		status = join_drag(&layout, error);
	if (status == TW_OK)
		status = compute(&layout, &request, error);
	clear(&layout);
	layout_request_clear(&request);
	return status;
}
