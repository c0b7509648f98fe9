#include "service/worker/layout_work.h"

#include "service/worker/motion_source.h"

#include <stdlib.h>

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

enum tw_status layout_work_load(struct layout_work *layout, struct work *work, const char *layout_id,
				struct tw_error *error)
{
	char(*fields)[STORE_ID_SIZE] = NULL;
	char mesh_id[STORE_ID_SIZE];
	size_t count = 0;
	*layout = (struct layout_work){.work = work};
	enum tw_status status = resource_needs(work->store, layout_id, RESOURCE_FIELD, &fields, &count, error);
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
	return status;
}

enum tw_status layout_work_load_motions(struct layout_work *layout, struct tw_error *error)
{
	enum tw_status status = find_motions_with_frames(layout, error);
	return status == TW_OK ? read_motion_names(layout, error) : status;
}

void layout_work_clear(struct layout_work *layout)
{
	for (size_t i = 0; layout->motion_names && i < layout->motion_count; i++)
		free((char *)layout->motion_names[i]);
	free(layout->motion_names);
	free(layout->motion_has_frames);
	free(layout->motion_ids);
	blob_source_clear(&layout->source);
}

static bool is_cancelled(void *context)
{
	struct layout_work *layout = context;
	return work_is_stopped(layout->work);
}

struct layout_input layout_work_input(struct layout_work *layout)
{
	return (struct layout_input){
		.garment = &layout->mesh->garment,
		.topology = &layout->mesh->topology,
		.field = &layout->field->field,
		.base = layout->base,
		.threads = layout->work->threads,
		.memory_limit = layout->work->search_limit,
		.cancelled = is_cancelled,
		.context = layout,
	};
}

enum tw_status layout_work_take_files(struct work *work, const struct layout_output *output, struct tw_error *error)
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
	return TW_OK;
}
