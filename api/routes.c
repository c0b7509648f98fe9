#include "api/handlers.h"
#include "storage/key.h"

#define JSON "application/json"

#define READ KEY_READ
#define SUBMIT KEY_SUBMIT
#define RIG KEY_RIG
#define ADMIN KEY_ADMIN

const struct route api_routes[] = {
	{"GET", "/livez", get_live, JSON, ROUTE_NO_BODY, NULL, ROUTE_STORELESS, 0},
	{"GET", "/readyz", get_ready, JSON, ROUTE_NO_BODY, NULL, 0, 0},
	{"GET", "/metrics", get_metrics, "text/plain", ROUTE_NO_BODY, NULL, ROUTE_OPERATOR, READ},
	{"GET", "/openapi.yaml", get_openapi, NULL, ROUTE_NO_BODY, NULL, ROUTE_STORELESS, 0},

	{"POST", "/v1/uploads", post_upload, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"GET", "/v1/uploads/{upload}", get_upload, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"PATCH", "/v1/uploads/{upload}", patch_upload, JSON, ROUTE_APPEND, NULL, 0, SUBMIT},
	{"DELETE", "/v1/uploads/{upload}", delete_upload, NULL, ROUTE_NO_BODY, NULL, 0, SUBMIT},

	{"GET", "/v1/meshes", list_meshes, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/meshes", post_mesh, JSON, ROUTE_UPLOAD, mesh_parts, 0, SUBMIT},
	{"GET", "/v1/meshes/{mesh}", get_mesh, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/meshes/{mesh}", delete_mesh, NULL, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"GET", "/v1/meshes/{mesh}/arrays/{array}", get_mesh_array, NULL, ROUTE_NO_BODY, NULL, 0, READ},
	{"GET", "/v1/meshes/{mesh}/motions", list_motions, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/meshes/{mesh}/motions", post_motion, JSON, ROUTE_UPLOAD, motion_parts, 0, SUBMIT},
	{"GET", "/v1/meshes/{mesh}/motions/{motion}", get_motion, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/meshes/{mesh}/motions/{motion}", delete_motion, NULL, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"GET", "/v1/meshes/{mesh}/motions/{motion}/arrays/{array}", get_motion_array, NULL, ROUTE_NO_BODY, NULL, 0,
	 READ},

	{"GET", "/v1/fields", list_fields, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/fields", post_field, JSON, ROUTE_JSON, NULL, 0, SUBMIT},
	{"GET", "/v1/fields/{field}", get_field, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/fields/{field}", delete_field, NULL, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"GET", "/v1/fields/{field}/arrays/{array}", get_field_array, NULL, ROUTE_NO_BODY, NULL, 0, READ},

	{"GET", "/v1/layouts", list_layouts, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/layouts", post_layout, JSON, ROUTE_JSON, NULL, 0, SUBMIT},
	{"GET", "/v1/layouts/{layout}", get_layout, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/layouts/{layout}", delete_layout, NULL, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"POST", "/v1/layouts/{layout}/renew", renew_layout, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT},
	{"GET", "/v1/layouts/{layout}/{artifact}", get_layout_artifact, NULL, ROUTE_NO_BODY, NULL, 0, READ},

	{"GET", "/v1/jobs", list_jobs, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/jobs/cancel", cancel_jobs, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT | RIG},
	{"POST", "/v1/jobs/redrive", redrive_jobs, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT | RIG},
	{"GET", "/v1/jobs/{job}", get_job, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"GET", "/v1/jobs/{job}/events", get_job_events, "text/event-stream", ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/jobs/{job}/cancel", cancel_job, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT | RIG},
	{"POST", "/v1/jobs/{job}/redrive", redrive_job, JSON, ROUTE_NO_BODY, NULL, 0, SUBMIT | RIG},

	{"GET", "/v1/rig", get_rig, JSON, ROUTE_NO_BODY, NULL, 0, RIG},
	{"GET", "/v1/rig/recordings", list_recordings, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"POST", "/v1/rig/recordings", post_recording, JSON, ROUTE_JSON, NULL, 0, RIG},
	{"GET", "/v1/rig/recordings/{recording}", get_recording, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/rig/recordings/{recording}", delete_recording, NULL, ROUTE_NO_BODY, NULL, 0, RIG},
	{"GET", "/v1/rig/recordings/{recording}/samples", get_recording_samples, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"GET", "/v1/rig/recordings/{recording}/samples.csv", get_recording_csv, "text/csv", ROUTE_NO_BODY, NULL, 0,
	 READ},

	{"GET", "/v1/tenant", get_tenant, JSON, ROUTE_NO_BODY, NULL, 0, READ},
	{"DELETE", "/v1/tenant", delete_tenant, JSON, ROUTE_NO_BODY, NULL, 0, ADMIN},
	{"GET", "/v1/keys", list_keys, JSON, ROUTE_NO_BODY, NULL, 0, ADMIN},
	{"POST", "/v1/keys", post_key, JSON, ROUTE_JSON, NULL, 0, ADMIN},
	{"GET", "/v1/keys/{key}", get_key, JSON, ROUTE_NO_BODY, NULL, 0, ADMIN},
	{"DELETE", "/v1/keys/{key}", revoke_key, NULL, ROUTE_NO_BODY, NULL, 0, ADMIN},
	{"POST", "/v1/keys/{key}/rotate", rotate_key, JSON, ROUTE_NO_BODY, NULL, 0, ADMIN},

	{NULL, NULL, NULL, NULL, ROUTE_NO_BODY, NULL, 0, 0},
};
