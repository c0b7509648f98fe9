/* API keys at run time: made, listed, rotated and revoked by those who have the scope admin, for their own tenant; by
 * the operator for every tenant. Nobody can give a key more than he has. */
#include "api/handlers.h"
#include "api/json.h"
#include "api/page.h"
#include "api/time_text.h"
#include "solver/option_json.h"
#include "storage/key.h"

#include <string.h>

#define OVERLAP_DEFAULT_S (24 * 3600)

/* --- shown ------------------------------------------------------------------------------------------------------ */

static json_t *show_scopes(unsigned scopes)
{
	char text[KEY_SCOPES_SIZE];
	key_print_scopes(scopes, text);
	return json_words(text);
}

static json_t *show_limit(int64_t limit)
{
	return limit ? json_integer(limit) : json_null();
}

static json_t *show_limits(const struct key_limits *limits)
{
	json_t *json = json_object();
	json_object_set_new(json, "requests_per_s", show_limit(limits->requests_per_s));
	json_object_set_new(json, "requests_per_min", show_limit(limits->requests_per_min));
	json_object_set_new(json, "queued_jobs", show_limit(limits->queued_jobs));
	json_object_set_new(json, "stored_bytes", show_limit(limits->stored_bytes));
	return json;
}

static json_t *show_usage(const struct key *key)
{
	json_t *json = json_object();
	json_object_set_new(json, "requests", json_integer(key->requests));
	json_object_set_new(json, "last_used_at", json_time(key->last_used_ms));
	json_object_set_new(json, "queued_jobs", json_integer(key->queued_jobs));
	json_object_set_new(json, "stored_bytes", json_integer(key->stored_bytes));
	return json;
}

/* `secret`: where it has just been made, and only then; else NULL. */
static json_t *show_key(const struct key *key, const char *secret)
{
	char href[KIND_HREF_SIZE];
	json_t *json = json_object();
	snprintf(href, sizeof href, "/v1/keys/%s", key->id);
	json_object_set_new(json, "id", json_string(key->id));
	json_object_set_new(json, "tenant", json_string(key->tenant));
	json_object_set_new(json, "name", json_string(key->name));
	json_object_set_new(json, "scopes", show_scopes(key->scopes));
	json_object_set_new(json, "weight", json_integer(key->weight));
	json_object_set_new(json, "limits", show_limits(&key->limits));
	json_object_set_new(json, "created_at", json_time(key->created_ms));
	json_object_set_new(json, "expires_at", json_time(key->expires_ms));
	json_object_set_new(json, "revoked_at", json_time(key->revoked_ms));
	json_object_set_new(json, "rotated_at", json_time(key->rotated_ms));
	json_object_set_new(json, "overlap_until", json_time(key->overlap_until_ms));
	json_object_set_new(json, "usage", show_usage(key));
	json_object_set_new(json, "href", json_string(href));
	if (secret)
		json_object_set_new(json, "secret", json_string(secret));
	return json;
}

static enum tw_status respond_key(struct api_call *call, unsigned http_status, const struct key *key,
				  const char *secret, struct tw_error *error)
{
	if (secret)
		response_header(&call->response, "Cache-Control", "no-store");
	return response_json(&call->response, http_status, show_key(key, secret), error);
}

/* --- whose ------------------------------------------------------------------------------------------------------ */

/* The tenant that is meant: the caller's own, or for the operator any. To everybody else there are no others. */
static enum tw_status choose_tenant(const struct api_call *call, const char *name, bool makes, int64_t *tenant,
				    struct tw_error *error)
{
	int64_t found = 0;
	*tenant = call->caller.owner.tenant;
	if (!name)
		return TW_OK;
	enum tw_status status = tenant_find(call->store, name, &found, error);
	if (status == TW_OK && (call->caller.is_operator || found == *tenant)) {
		*tenant = found;
		return TW_OK;
	}
	if (status != TW_OK && status != TW_ERROR_NOT_FOUND)
		return status;
	if (makes && call->caller.is_operator)
		return tenant_create(call->store, name, tenant, error);
	return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-tenant", "tenant", "there is no tenant %.64s", name);
}

static enum tw_status find_key(struct api_call *call, struct key *key, int64_t *tenant, struct tw_error *error)
{
	static const char *const known[] = {"tenant", NULL};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = choose_tenant(call, query_get(&call->query, "tenant"), false, tenant, error);
	return status == TW_OK ? key_get(call->store, *tenant, call->match.parameters[0], key, error) : status;
}

/* --- requests --------------------------------------------------------------------------------------------------- */

/* The scopes that are asked for are at fault, not the caller's key. */
static enum tw_status refuse_scope_at(const struct api_call *call, const char *pointer, unsigned scope,
				      struct tw_error *error)
{
	enum tw_status status = call_refuse_scope(call, scope, error);
	snprintf(error->where, sizeof error->where, "%s", pointer);
	return status;
}

static enum tw_status parse_scopes(const struct api_call *call, const json_t *body, unsigned *scopes,
				   struct tw_error *error)
{
	const json_t *list = json_object_get(body, "scopes");
	*scopes = 0;
	if (!json_is_array(list) || !json_array_size(list))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", "/scopes",
			       "scopes is a list of these words: " KEY_SCOPE_WORDS);
	for (size_t i = 0; i < json_array_size(list); i++) {
		unsigned scope = 0;
		const char *word = json_string_value(json_array_get(list, i));
		bool is_one = word && !strchr(word, ',') && key_parse_scopes(word, &scope, NULL) == TW_OK;
		char pointer[32];
		snprintf(pointer, sizeof pointer, "/scopes/%zu", i);
		if (!is_one)
			return tw_fail(error, TW_ERROR_INPUT, "key-scope", pointer,
				       "this is no scope; there are: " KEY_SCOPE_WORDS);
		if (scope & ~call->caller.scopes)
			return refuse_scope_at(call, pointer, scope, error);
		*scopes |= scope;
	}
	return TW_OK;
}

static enum tw_status parse_weight(const json_t *body, uint32_t *weight, struct tw_error *error)
{
	const json_t *value = json_object_get(body, "weight");
	json_int_t number = value ? json_integer_value(value) : 1;
	if ((value && !json_is_integer(value)) || number < 1 || number > JOB_WEIGHT_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "key-weight", "/weight",
			       "a weight is a whole number from 1 to %d", JOB_WEIGHT_MAX);
	*weight = (uint32_t)number;
	return TW_OK;
}

static enum tw_status parse_limit(const json_t *limits, const char *name, int64_t *limit, struct tw_error *error)
{
	char pointer[64];
	const json_t *value = json_object_get(limits, name);
	*limit = 0;
	if (!value || json_is_null(value))
		return TW_OK;
	*limit = json_integer_value(value);
	snprintf(pointer, sizeof pointer, "/limits/%s", name);
	if (!json_is_integer(value) || *limit < 1)
		return tw_fail(error, TW_ERROR_INPUT, "json-type", pointer,
			       "a limit is a whole number from 1 on, or null for none");
	return TW_OK;
}

static enum tw_status parse_limits(const json_t *body, struct key_limits *limits, struct tw_error *error)
{
	static const char *const known[] = {"requests_per_s", "requests_per_min", "queued_jobs", "stored_bytes", NULL};
	int64_t *const values[] = {&limits->requests_per_s, &limits->requests_per_min, &limits->queued_jobs,
				   &limits->stored_bytes};
	const json_t *given = json_object_get(body, "limits");
	if (!given)
		return TW_OK;
	if (!json_is_object(given))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", "/limits", "limits must be an object");
	enum tw_status status = json_check_members(given, "/limits", known, error);
	for (size_t i = 0; status == TW_OK && known[i]; i++)
		status = parse_limit(given, known[i], values[i], error);
	return status;
}

static enum tw_status parse_expiry(const json_t *body, int64_t *expires_ms, struct tw_error *error)
{
	const char *text = NULL;
	*expires_ms = 0;
	enum tw_status status = json_get_text(body, "expires_at", false, &text, error);
	if (status != TW_OK || !text)
		return status;
	if (time_text_read(text, expires_ms) && *expires_ms > 0) /* 0 would be never */
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "json-value", "/expires_at", "a time is written as 2027-01-31T12:00:00Z");
}

/* Where in the request what storage refuses stands. */
static void place(struct tw_error *error)
{
	static const char *const places[][2] = {{"key-name", "/name"},
						{"key-expiry", "/expires_at"},
						{"key-limit", "/limits"},
						{"tenant-name", "/tenant"}};
	for (size_t i = 0; i < sizeof places / sizeof *places; i++)
		if (error->type && !strcmp(error->type, places[i][0]))
			snprintf(error->where, sizeof error->where, "%s", places[i][1]);
}

static enum tw_status create_key(struct api_call *call, const json_t *body, struct tw_error *error)
{
	static const char *const known[] = {"tenant", "name", "scopes", "expires_at", "weight", "limits", NULL};
	char secret[SECRET_SIZE];
	const char *tenant = NULL;
	struct key key = {0};
	struct key_draft draft = {0};
	enum tw_status status = json_check_members(body, "", known, error);
	if (status == TW_OK)
		status = json_get_text(body, "name", true, &draft.name, error);
	if (status == TW_OK)
		status = json_get_text(body, "tenant", false, &tenant, error);
	if (status == TW_OK)
		status = parse_scopes(call, body, &draft.scopes, error);
	if (status == TW_OK)
		status = parse_expiry(body, &draft.expires_ms, error);
	if (status == TW_OK)
		status = parse_weight(body, &draft.weight, error);
	if (status == TW_OK)
		status = parse_limits(body, &draft.limits, error);
	/* Before a tenant is made for a key that there will not be. */
	if (status == TW_OK)
		status = key_check(call->store, &draft, error);
	if (status == TW_OK)
		status = choose_tenant(call, tenant, true, &draft.tenant, error);
	if (status == TW_OK)
		status = key_create(call->store, &draft, &key, secret, error);
	if (status != TW_OK) {
		place(error);
		return status;
	}
	response_header(&call->response, "Location", "/v1/keys/%s", key.id);
	return respond_key(call, 201, &key, secret, error);
}

enum tw_status post_key(struct api_call *call, struct tw_error *error)
{
	json_t *body = NULL;
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = option_json_parse(&body, call->body, call->body_size, error);
	if (status == TW_OK)
		status = create_key(call, body, error);
	json_decref(body);
	return status;
}

enum tw_status list_keys(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"tenant", "limit", "cursor", NULL};
	uint32_t limit = 0;
	int64_t cursor = 0, tenant = 0;
	struct key_page page = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = page_parameters(call, &limit, &cursor, error);
	if (status == TW_OK)
		status = choose_tenant(call, query_get(&call->query, "tenant"), false, &tenant, error);
	if (status == TW_OK)
		status = key_list(call->store, tenant, cursor, limit, &page, error);
	if (status != TW_OK)
		return status;
	json_t *items = json_array();
	for (size_t i = 0; i < page.count; i++)
		json_array_append_new(items, show_key(&page.keys[i], NULL));
	int64_t next = page.next;
	key_page_clear(&page);
	return page_respond(call, items, next, error);
}

enum tw_status get_key(struct api_call *call, struct tw_error *error)
{
	struct key key = {0};
	int64_t tenant = 0;
	enum tw_status status = find_key(call, &key, &tenant, error);
	return status == TW_OK ? respond_key(call, 200, &key, NULL, error) : status;
}

enum tw_status rotate_key(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"tenant", "overlap_s", NULL};
	char secret[SECRET_SIZE];
	struct key key = {0};
	int64_t tenant = 0, overlap_s = 0;
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = query_integer(&call->query, "overlap_s", OVERLAP_DEFAULT_S, 0, KEY_OVERLAP_MAX_S, &overlap_s,
				       error);
	if (status == TW_OK)
		status = choose_tenant(call, query_get(&call->query, "tenant"), false, &tenant, error);
	if (status == TW_OK)
		status = key_get(call->store, tenant, call->match.parameters[0], &key, error);
	/* What comes of it is told to the caller, who would have the key's scopes then. */
	if (status == TW_OK && key.scopes & ~call->caller.scopes)
		status = call_refuse_scope(call, key.scopes & ~call->caller.scopes, error);
	if (status == TW_OK)
		status = key_rotate(call->store, tenant, key.id, 1000 * overlap_s, &key, secret, error);
	return status == TW_OK ? respond_key(call, 200, &key, secret, error) : status;
}

enum tw_status revoke_key(struct api_call *call, struct tw_error *error)
{
	struct key key = {0};
	int64_t tenant = 0;
	enum tw_status status = find_key(call, &key, &tenant, error);
	if (status == TW_OK)
		status = key_revoke(call->store, tenant, key.id, &key, error);
	if (status == TW_OK)
		response_empty(&call->response, 204);
	return status;
}

/* --- the tenant ------------------------------------------------------------------------------------------------- */

static enum tw_status show_tenant(struct api_call *call, json_t **json, struct tw_error *error)
{
	char name[TENANT_NAME_SIZE];
	struct key key = {0};
	const struct access_key *own = call->caller.key;
	enum tw_status status = tenant_name(call->store, call->caller.owner.tenant, name, error);
	/* One of a key file has no row. */
	bool has_row = own && own->owner.client > 0;
	if (status == TW_OK && has_row)
		status = key_get_number(call->store, own->owner.client, &key, error);
	if (status != TW_OK)
		return status;
	*json = json_object();
	json_object_set_new(*json, "name", json_string(name));
	json_object_set_new(*json, "scopes", show_scopes(call->caller.scopes));
	json_object_set_new(*json, "key", has_row ? show_key(&key, NULL) : json_null());
	return TW_OK;
}

enum tw_status get_tenant(struct api_call *call, struct tw_error *error)
{
	json_t *json = NULL;
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = show_tenant(call, &json, error);
	return status == TW_OK ? response_json(&call->response, 200, json, error) : status;
}

enum tw_status delete_tenant(struct api_call *call, struct tw_error *error)
{
	char name[TENANT_NAME_SIZE];
	const char *confirmed = call_header(call, "Confirm-Delete");
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = tenant_name(call->store, call->caller.owner.tenant, name, error);
	if (status == TW_OK && (!confirmed || strcmp(confirmed, name) != 0))
		status = tw_fail(error, TW_ERROR_INPUT, "not-confirmed", "Confirm-Delete",
				 "this deletes all that the tenant has, its keys too, for ever; if that is meant, send "
				 "its name, as Confirm-Delete: %s",
				 name);
	if (status == TW_OK)
		status = tenant_delete(call->store, name, error);
	if (status != TW_OK)
		return status;
	return response_json(&call->response, 202, json_pack("{s:s, s:s}", "name", name, "state", "deleting"), error);
}
