#include "service/daemon/http/account.h"

#include "api/route.h"
#include "service/clock.h"
#include "service/log.h"

#define STATUS_CLIENT_GONE 499 /* where a client has left before it got an answer */

void account_request(struct metrics *metrics, const struct account *account)
{
	const double seconds = (double)(monotonic_us() - account->started_us) / 1e6;
	const struct route *route = exchange_route(account->exchange);
	const unsigned status = account->status ? account->status : STATUS_CLIENT_GONE;
	metrics_count_request(metrics, route, status, seconds);
	log_event(LOG_LEVEL_INFO, "request",
		  "id=%s peer=%s tenant=%s key=%s method=%s route=\"%s\" status=%u ms=%.2f received=%llu%s",
		  exchange_request_id(account->exchange), account->peer, exchange_tenant_name(account->exchange),
		  exchange_key_name(account->exchange), account->method ? account->method : "",
		  route ? route->path : "", status, seconds * 1e3, (unsigned long long)account->received,
		  account->is_complete ? "" : " aborted=true");
}
