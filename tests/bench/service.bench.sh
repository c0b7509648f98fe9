#!/bin/sh
# The service under its largest upload and its main job: how much the daemon's memory grows while a 727,000-vertex suit comes in
# and is imported, and how long ten terminals take on the 23,500-vertex sample, from the request to the stored layout.
#   TIGHTWIRE  the binary
set -eu
folder=$(mktemp -d)
daemon=
clean() {
	[ -z "$daemon" ] || { kill -TERM "$daemon" 2>/dev/null; wait "$daemon" 2>/dev/null || true; }
	rm -rf "$folder"
}
trap clean EXIT

line() { # NAME VALUE UNIT GOAL: at most GOAL
	printf '%-36s %12s %-6s <= %-7s %s\n' "$1" "$2" "$3" "$4" "$(jq -rn "if $2 <= $4 then \"ok\" else \"MISSED\" end")"
}

"$TIGHTWIRE" sample --out "$folder/large" --vertices 727000 >/dev/null
"$TIGHTWIRE" sample --out "$folder/usual" --vertices 23500 >/dev/null
"$TIGHTWIRE" serve --listen 127.0.0.1:0 --store "sqlite:$folder/tightwire.db" --workers 1 --log-level error >"$folder/log" &
daemon=$!
until base=$(sed -n 's/^listening on //p' "$folder/log") && [ -n "$base" ]; do sleep 0.1; done

post() { # PATH TYPE FILE
	curl -sS --fail-with-body -X POST "$base$1" -H "Content-Type: $2" -H 'Prefer: wait=60' --data-binary "@$3"
}
finished() { # PATH of a resource: waits for its end, prints it
	until curl -sS "$base$1" | tee "$folder/it" | jq -e '.state == "succeeded"' >/dev/null; do
		jq -e '.state == "failed"' "$folder/it" >/dev/null && { jq . "$folder/it" >&2; exit 1; }
		sleep 0.2
	done
	cat "$folder/it"
}
peak_kib() { sed -n 's/^VmHWM:[^0-9]*\([0-9]*\).*/\1/p' "/proc/$daemon/status"; }

# The usual suit first, so that what every upload needs is there already.
mesh=$(post '/v1/meshes' model/obj "$folder/usual/suit.obj" | jq -r .id)
before=$(peak_kib)
start=$(date +%s.%N)
large=$(curl -sS --fail-with-body -T "$folder/large/suit.obj" -X POST "$base/v1/meshes" -H 'Content-Type: model/obj' | jq -r .href)
uploaded=$(date +%s.%N)
finished "$large" >"$folder/large.json"
line "daemon memory growth, 727k upload" "$(jq -n "($(peak_kib) - $before) / 1024 * 10 | round / 10")" MiB 64
line "727k upload of $(du -m "$folder/large/suit.obj" | cut -f1) MiB" "$(jq -n "($uploaded - $start) * 100 | round / 100")" s 30
line "727k import" "$(jq -n "($(date +%s.%N) - $uploaded) * 100 | round / 100")" s 60

motions=
for file in "$folder"/usual/motions/*.pc2; do
	id=$(post "/v1/meshes/$mesh/motions?name=$(basename "$file" .pc2)" application/octet-stream "$file" | jq -r .id)
	motions="$motions${motions:+,}\"$id\""
done
echo "{\"mesh\":\"$mesh\",\"motions\":[$motions]}" >"$folder/field.json"
field=$(post /v1/fields application/json "$folder/field.json" | jq -r .id)
jq --arg field "$field" '{field: $field, terminals: .terminals}' "$folder"/usual/terminals/joints10.json >"$folder/request.json"
best=1e9 tree=1e9
for _ in 1 2 3; do
	start=$(date +%s.%N)
	href=$(post /v1/layouts application/json "$folder/request.json" | jq -r .href)
	finished "$href" >"$folder/layout.json"
	best=$(jq -n "[$best, $(date +%s.%N) - $start] | min | . * 1000 | round / 1000")
	tree=$(jq "[$tree, .summary.seconds.tree] | min | . * 1000 | round / 1000" "$folder/layout.json")
done
line "10 terminals, 23,500 vertices: exact tree" "$tree" s 3
line "10 terminals: request to stored layout" "$best" s 3
