/* A motion's frames are its upload (part "motion"), or packed (part "frames"), or nothing. */
#include "service/worker/motion_source.h"

#include "solver/motion/options.h"
#include "storage/resources.h"

#include <string.h>

static enum tw_status has_part(struct store *store, const char *motion_id, const char *part, bool *has,
			       struct tw_error *error)
{
	struct blob blob;
	enum tw_status status = blob_find(store, motion_id, BLOB_UPLOAD, part, &blob, error);
	*has = status == TW_OK;
	return status == TW_ERROR_NOT_FOUND ? TW_OK : status;
}

static enum tw_status find_part(struct store *store, const char *motion_id, const char **part, struct tw_error *error)
{
	static const char *const parts[] = {"motion", "frames"};
	*part = NULL;
	for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
		bool has = false;
		enum tw_status status = has_part(store, motion_id, parts[i], &has, error);
		if (has)
			*part = parts[i];
		if (status != TW_OK || has)
			return status;
	}
	return TW_OK;
}

enum tw_status motion_has_frames(struct store *store, const char *motion_id, bool *has, struct tw_error *error)
{
	const char *part = NULL;
	enum tw_status status = find_part(store, motion_id, &part, error);
	*has = part != NULL;
	return status;
}

static enum tw_status find_unit(enum length_unit *unit, struct store *store, const struct cached_mesh *mesh,
				const char *motion_id, struct tw_error *error)
{
	struct resource motion;
	struct motion_options options;
	enum tw_status status = resource_get(store, TENANT_ANY, RESOURCE_MOTION, motion_id, &motion, error);
	if (status != TW_OK)
		return status;
	status = cache_read_options(&motion_option_table, &options, motion.options, error);
	if (status == TW_OK)
		*unit = motion_unit(&options, (enum length_unit)mesh->options.unit);
	resource_clear(&motion);
	return status;
}

enum tw_status motion_source_open(struct motion_reader **reader, struct blob_source *source, struct store *store,
				  const struct cached_mesh *mesh, const char *motion_id, struct tw_error *error)
{
	const char *part = NULL;
	struct byte_source stream;
	enum length_unit unit = UNIT_MM;
	memset(source, 0, sizeof *source);
	enum tw_status status = find_part(store, motion_id, &part, error);
	if (status == TW_OK && !part)
		status = tw_fail(error, TW_ERROR_INPUT, "motion-without-frames", NULL,
				 "of the motion %s no frames were kept; import it again with frames upload or packed",
				 motion_id);
	if (status == TW_OK)
		status = find_unit(&unit, store, mesh, motion_id, error);
	if (status == TW_OK)
		status = blob_source_init(source, store, motion_id, part, &stream, error);
	if (status != TW_OK)
		return status;
	return motion_open(reader, &stream, MOTION_SNIFF, unit, garment_source_count(&mesh->garment), error);
}
