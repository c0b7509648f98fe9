/* The handlers that the route table names, by the file they live in. Each fills call->response or returns an error. */
#ifndef API_HANDLERS_H
#define API_HANDLERS_H

#include "api/call.h"

/* operation.c */
enum tw_status get_live(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_ready(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_metrics(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_openapi(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* upload_handlers.c */
enum tw_status post_upload(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_upload(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status patch_upload(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_upload(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* mesh.c */
extern const char *const mesh_parts[];
extern const char *const motion_parts[];
enum tw_status post_mesh(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_meshes(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_mesh(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_mesh_array(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_mesh(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status post_motion(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_motions(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_motion(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_motion_array(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_motion(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* field.c */
enum tw_status post_field(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_fields(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_field(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_field_array(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_field(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* layout.c */
enum tw_status post_layout(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_layouts(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_layout(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_layout_artifact(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_layout(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* renew.c */
enum tw_status renew_layout(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* job.c */
enum tw_status list_jobs(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_job(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status cancel_job(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status redrive_job(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* job_bulk.c */
enum tw_status cancel_jobs(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status redrive_jobs(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* events.c */
enum tw_status get_job_events(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* keys.c */
enum tw_status post_key(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_keys(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_key(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status rotate_key(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status revoke_key(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_tenant(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_tenant(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* rig.c */
enum tw_status get_rig(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status post_recording(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status list_recordings(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_recording(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_recording_csv(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status get_recording_samples(struct api_call *call, struct tw_error *error) TW_NODISCARD;
enum tw_status delete_recording(struct api_call *call, struct tw_error *error) TW_NODISCARD;

#endif
