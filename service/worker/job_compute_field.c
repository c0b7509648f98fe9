/* The job that makes a field: the motions' mean densities, the worst of each face, and what that makes every edge cost.
 *
 * The means that a motion keeps are against the flat pattern. With another reference the frames are read again. */
#include "service/worker/motion_means.h"
#include "solver/layout/summary.h"

#include <stdlib.h>

/* Of one motion at a time: hundreds of them make no difference to the memory that is needed. */
static enum tw_status add_motion(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
				 const struct field_options *options, double share_from, double share_to,
				 double *density, struct tw_error *error)
{
	double *mean = NULL;
	struct arena_mark mark = arena_mark(work->arena);
	enum tw_status status = work_step(work, share_from, "strain", error);
	if (status == TW_OK)
		status = motion_mean(work, mesh, motion_id, options, resource_kind_row(RESOURCE_FIELD)->version,
				     share_from, share_to, &mean, error);
	if (status == TW_OK)
		strain_raise(density, mean, mesh->garment.face_count);
	arena_release(work->arena, mark);
	return status;
}

/* The largest mean density over the motions, of every face. */
static enum tw_status find_worst(struct work *work, const struct cached_mesh *mesh, const struct field_options *options,
				 double *density, size_t *motion_count, struct tw_error *error)
{
	char(*ids)[STORE_ID_SIZE] = NULL;
	enum tw_status status =
		resource_needs(work->store, work->resource->id, RESOURCE_MOTION, &ids, motion_count, error);
	if (status != TW_OK)
		return status;
	for (size_t i = 0; status == TW_OK && i < *motion_count; i++) {
		double share = 0.5 / (double)*motion_count;
		status = add_motion(work, mesh, ids[i], options, share * (double)i, share * (double)(i + 1), density,
				    error);
	}
	free(ids);
	return status;
}

static json_t *show_field(const struct field *field, const struct field_options *options, size_t motion_count)
{
	uint64_t least = UINT64_MAX;
	uint64_t largest = 0;
	json_int_t forbidden = 0;
	double density = 0;
	for (uint32_t e = 0; e < field->edge_count; e++) {
		uint64_t weight = field->weight[e];
		if (weight == FIELD_FORBIDDEN) {
			forbidden++;
			continue;
		}
		least = weight < least ? weight : least;
		largest = weight > largest ? weight : largest;
	}
	for (uint32_t f = 0; f < field->face_count; f++)
		density = field->density[f] > density ? field->density[f] : density;
	struct warning_list warnings = {0};
	field_warn_of_no_motion(field, &warnings);
	json_t *json =
		json_pack("{s:I, s:I, s:I, s:I, s:f, s:f, s:o, s:o}", "faces", (json_int_t)field->face_count, "edges",
			  (json_int_t)field->edge_count, "motions", (json_int_t)motion_count, "forbidden_edges",
			  forbidden, "scale", field->scale, "largest_density_mpa", density, "preset_changes",
			  field_options_changes(options), "warnings", warning_list_show(&warnings));
	double energy_scale = field_energy_scale(field);
	if (json && layout_weight_add(json, "least_weight", least == UINT64_MAX ? 0 : least, energy_scale) &&
	    layout_weight_add(json, "largest_weight", largest, energy_scale))
		return json;
	json_decref(json);
	return NULL;
}

static int show_weighing(void *context, double share)
{
	struct tw_error stopped;
	return work_step(context, 0.5 + 0.2 * share, "weights", &stopped) != TW_OK;
}

static int show_chords(void *context, double share)
{
	struct tw_error stopped;
	return work_step(context, 0.7 + 0.3 * share, "chords", &stopped) != TW_OK;
}

static enum tw_status compute(struct work *work, const struct cached_mesh *mesh, const struct field_options *options,
			      struct field *field, size_t *motion_count, struct tw_error *error)
{
	double *density = ARENA_ZEROED(work->arena, mesh->garment.face_count, double);
	if (!density)
		return tw_fail_memory(error);
	enum tw_status status = find_worst(work, mesh, options, density, motion_count, error);
	if (status != TW_OK)
		return status;
	const struct field_watch watch = {show_weighing, work}, chord_watch = {show_chords, work};
	status = field_weigh_watched(field, work->arena, &mesh->garment, &mesh->topology, density, options, NULL,
				     work->threads, &watch, error);
	if (status == TW_OK)
		status = field_weigh_chords(field, work->arena, &mesh->garment, &mesh->topology, NULL, work->threads,
					    &chord_watch, error);
	return status;
}

enum tw_status job_compute_field(struct work *work, struct tw_error *error)
{
	char mesh_id[STORE_ID_SIZE];
	const struct cached_mesh *mesh = NULL;
	struct field_options options;
	size_t motion_count = 0;
	/* In the arena, because its arrays (the scale is one) are written after this function has returned. */
	struct field *field = ARENA_ZEROED(work->arena, 1, struct field);
	struct tw_array *arrays = ARENA_ARRAY(work->arena, FIELD_ARRAYS, struct tw_array);
	if (!field || !arrays)
		return tw_fail_memory(error);
	enum tw_status status = cache_read_options(&field_option_table, &options, work->resource->options, error);
	if (status == TW_OK)
		status = work_find_mesh(work, work->resource->id, mesh_id, error);
	if (status == TW_OK)
		status = cache_mesh(work->cache, work->store, mesh_id, &mesh, error);
	if (status != TW_OK)
		return status;
	status = compute(work, mesh, &options, field, &motion_count, error);
	if (status != TW_OK)
		return status;
	work->result.array_count = field_to_arrays(field, arrays);
	work->result.arrays = arrays;
	return work_summary(work, show_field(field, &options, motion_count), error);
}
