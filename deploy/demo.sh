#!/bin/sh
# demo.sh BINARY: starts the service on a fresh embedded store, gives it a suit and its motions over HTTP as any client would, asks
# for the layouts of four terminal sets and shows what came back. DATA: a folder with real suits; else `tightwire sample` makes one.
set -eu
binary=$1
out=build/demo
data=${DATA:-}
rm -rf "$out"
mkdir -p "$out"

# --- the suit ---------------------------------------------------------------------------------------------------------
if [ -n "$data" ] && [ -f "$data/suits/L/suit.obj" ]; then
	suit=$data/suits/L/suit.obj motions=$data/motions/L terminals=$data/terminals/L
	sets='tesla10 xsens17 haptic36'
	echo "suit: $suit"
else
	"$binary" sample --out "$out/sample" --vertices 23500
	suit=$out/sample/suit.obj motions=$out/sample/motions terminals=$out/sample/terminals
	sets=$(cd "$terminals" && ls -1 ./*.json | sed 's/^\.\///; s/\.json$//' | grep -v 80)
	echo "suit: $suit (generated)"
fi

# --- the service --------------------------------------------------------------------------------------------------------
"$binary" serve --listen 127.0.0.1:0 --store "sqlite:$out/tightwire.db" --workers 2 --log-level warning >"$out/serve.log" 2>&1 &
daemon=$!
trap 'kill -TERM $daemon 2>/dev/null; wait $daemon 2>/dev/null || true' EXIT
trap 'exit 1' INT TERM
base=
for _ in $(seq 100); do
	base=$(sed -n 's/^listening on //p' "$out/serve.log")
	[ -n "$base" ] && break
	sleep 0.1
done
[ -n "$base" ] || { echo "demo: the service did not start:"; cat "$out/serve.log"; exit 1; }
echo "service: $base (two workers, store $out/tightwire.db)"

# request METHOD PATH [curl arguments]: the answer's body; ends the demo with the problem when it is an error.
request() {
	method=$1 path=$2
	shift 2
	curl -sS -X "$method" --fail-with-body "$base$path" "$@" || { echo >&2; echo "demo: $method $path failed" >&2; exit 1; }
}

# --- uploads: each is kept as it came, and a job reads it -----------------------------------------------------------------
start=$(date +%s.%N)
mesh=$(request POST "/v1/meshes?name=demo" -H 'Content-Type: model/obj' -H 'Prefer: wait=60' --data-binary "@$suit" | jq -r .id)
ids=
for file in "$motions"/*.pc2; do
	name=$(basename "$file" .pc2)
	id=$(request POST "/v1/meshes/$mesh/motions?name=$name" -H 'Content-Type: application/octet-stream' --data-binary "@$file" | jq -r .id)
	ids="$ids \"$id\""
done
list=$(echo $ids | tr ' ' ',')
request POST /v1/fields -H 'Content-Type: application/json' -H 'Prefer: wait=60' \
	-d "{\"mesh\":\"$mesh\",\"motions\":[$list]}" >"$out/field.json"
field=$(jq -r .id "$out/field.json")
[ "$(jq -r .state "$out/field.json")" = succeeded ] || { jq . "$out/field.json"; exit 1; }
request GET "/v1/meshes/$mesh" | jq -r '"garment: \(.summary.vertices) vertices, \(.summary.faces) faces, \(.summary.pieces | length) pieces"'
printf 'uploaded, imported and weighed under %s motions in %s s\n\n' "$(echo $ids | wc -w)" \
	"$(jq -n "$(date +%s.%N) - $start | . * 10 | round / 10")"

# --- layouts: the connection is held until the layout is there -------------------------------------------------------------
head='%-11s %-8s %13s %13s | %8s %8s %6s | %6s %6s %6s | %5s %5s %5s %5s %5s\n'

# lay_out SET: asks for one layout, waits for it and fetches its files; false where the service says no, or the job fails.
lay_out() {
	jq --arg field "$field" '{field: $field, terminals: .terminals}' "$terminals/$1.json" >"$out/$1/request.json"
	curl -sS "$base/v1/layouts" -H 'Content-Type: application/json' -H 'Prefer: wait=60' \
		--data-binary "@$out/$1/request.json" >"$out/$1/resource.json" || return
	jq -e .id "$out/$1/resource.json" >/dev/null || return
	layout=$(jq -r .id "$out/$1/resource.json")
	while jq -e '.state == "queued" or .state == "running"' "$out/$1/resource.json" >/dev/null; do
		sleep 1
		curl -sS "$base/v1/layouts/$layout" >"$out/$1/resource.json" || return
	done
	jq -e '.state == "succeeded"' "$out/$1/resource.json" >/dev/null || return
	for artifact in $(jq -r '.artifacts[].name' "$out/$1/resource.json"); do
		request GET "/v1/layouts/$layout/$artifact" >"$out/$1/$artifact"
	done
	for drawing in pattern suit; do
		rsvg-convert -w 1600 -b white "$out/$1/$drawing.svg" -o "$out/$1/$drawing.png" || return
	done
}

# figures SET: its row of the table.
figures() {
	jq -r '
		def round(d): . * pow(10; d) | round / pow(10; d);
		def percent: . * 100 | round(1) | "\(.)%";
		.summary | [ .outcome, .weight, .lower_bound,
		  (.energy_mpa_mm2 | round(0)), (.baseline_energy_mpa_mm2 | round(0)),
		  (1 - .energy_mpa_mm2 / .baseline_energy_mpa_mm2 | percent),
		  (.elongation_max | percent), (.baseline_elongation_max | percent),
		  (1 - .elongation_max / .baseline_elongation_max | percent),
		  (.seconds | (.terminals, .tree, .baseline, (.curves + .metrics + .elongation + .artifacts), .total) | round(2)) ]
		| map(tostring) | join(" ")' "$out/$1/resource.json"
}

# shellcheck disable=SC2059
{
	printf "$head" '' '' 'weight' 'lower bound' 'energy' 'fewest' 'saved' 'max' 'fewest' 'saved' 'place' 'tree' 'base' 'curve' 'all'
	printf "$head" 'terminals' 'outcome' '' '' 'MPa mm2' 'edges' '' 'elong.' 'edges' '' 's' 's' 's' 's' 's'
}
failed=
for set in $sets; do
	mkdir -p "$out/$set"
	if lay_out "$set"; then
		# shellcheck disable=SC2059,SC2046
		printf "$head" "$set" $(figures "$set")
	else
		failed="$failed $set"
		printf '%-11s failed: %s\n' "$set" "$(jq -r '.problem.detail // .detail // "no answer"' "$out/$set/resource.json")"
	fi
done

# --- where things are -----------------------------------------------------------------------------------------------------
echo
for set in $sets; do
	case "$failed " in *" $set "*) continue ;; esac
	ls "$out/$set"/layout.json "$out/$set"/*.svg "$out/$set"/*.png | tr '\n' ' '
	echo
done
[ -z "$failed" ] || { echo "demo: no layout for$failed" >&2; exit 1; }
