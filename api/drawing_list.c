#include "api/drawing_list.h"

#include "solver/layout/request.h"
#include "solver/names.h"

#include <string.h>

enum tw_status drawing_is_possible(struct api_call *call, const struct resource *layout, bool *possible,
				   struct tw_error *error)
{
	struct blob trees;
	*possible = false;
	if (!job_state_has_result(layout->job.state))
		return TW_OK;
	enum tw_status status =
		blob_find(call->store, layout->id, BLOB_ARRAY, job_kind_row(JOB_DRAW)->source, &trees, error);
	*possible = status == TW_OK;
	return status == TW_ERROR_NOT_FOUND ? TW_OK : status;
}

enum tw_status drawing_refuse_name(const char *name, struct tw_error *error)
{
	const char *names[LAYOUT_ARTIFACTS_MAX];
	uint32_t count = 0;
	while (layout_file_name(count)) {
		names[count] = layout_file_name(count);
		count++;
	}
	(void)names_refuse(&(struct names){names, count}, "file", name, "no-such-blob", NULL, error);
	return error->status = TW_ERROR_NOT_FOUND;
}

static bool has_name(const json_t *list, const char *name)
{
	for (size_t i = 0; i < json_array_size(list); i++)
		if (!strcmp(json_string_value(json_object_get(json_array_get(list, i), "name")), name))
			return true;
	return false;
}

void drawing_add_to_list(json_t *list, const char *path)
{
	const char *name;
	for (uint32_t i = 0; (name = layout_file_name(i)); i++) {
		char href[512];
		if (has_name(list, name))
			continue;
		snprintf(href, sizeof href, "%s/%s", path, name);
		json_array_append_new(list,
				      json_pack("{s:s, s:s, s:n, s:n, s:s}", "name", name, "media_type",
						layout_file_media_type(name), "size_bytes", "blake2b", "href", href));
	}
}
