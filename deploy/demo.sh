#!/bin/sh
# demo.sh BINARY: starts the service on a fresh embedded store, gives it a suit and its motions over HTTP as any client would, asks
# for the layouts of four terminal sets and shows what came back. DATA: a folder with real suits; else `tightwire sample` makes one.
set -eu
binary=$1
out=build/demo
data=${DATA:-}
rm -rf "$out"
mkdir -p "$out"

# What it does is said before it is done, and how long it took after.
since() { jq -nr "$(date +%s.%N) - $1 | . * 10 | round / 10"; }
begin() { began=$(date +%s.%N); printf '%s … ' "$*"; }
end() { printf '%s%s s\n' "${1:+$1, }" "$(since "$began")"; }

# --- the suit ---------------------------------------------------------------------------------------------------------
if [ -n "$data" ] && [ -f "$data/suits/L/suit.obj" ]; then
	suit=$data/suits/L/suit.obj motions=$data/motions/L terminals=$data/terminals/L
	echo "suit: $suit"
else
	begin 'generating a suit, its motions and terminal sets'
	"$binary" sample --out "$out/sample" --vertices 23500 >"$out/sample.log"
	end
	cat "$out/sample.log"
	suit=$out/sample/suit.obj motions=$out/sample/motions terminals=$out/sample/terminals
fi
# The smallest set first; of the largest, what is proven in this time.
sets=$(for file in "$terminals"/*.json; do
	echo "$(jq '.terminals | length' "$file") $(basename "$file" .json)"
done | sort -n | head -n 4 | cut -d' ' -f2)
limit_s=20

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
begin "garment: $(du -h "$suit" | cut -f1) uploaded and checked"
mesh=$(request POST "/v1/meshes?name=demo" -H 'Content-Type: model/obj' -H 'Prefer: wait=60' --data-binary "@$suit" | jq -r .id)
end "$(request GET "/v1/meshes/$mesh" | jq -r '.summary | "\(.vertices) vertices, \(.faces) faces, \(.pieces | length) pieces"')"
ids=
for file in "$motions"/*.pc2; do
	name=$(basename "$file" .pc2)
	begin "motion: $name, $(du -h "$file" | cut -f1) uploaded"
	id=$(request POST "/v1/meshes/$mesh/motions?name=$name" -H 'Content-Type: application/octet-stream' --data-binary "@$file" | jq -r .id)
	end
	ids="$ids $id"
done
begin "field: the strain energy of a strip along every edge, under $(echo $ids | wc -w) motions"
request POST /v1/fields -H 'Content-Type: application/json' -H 'Prefer: wait=60' \
	-d "$(jq -n --arg mesh "$mesh" --arg motions "${ids# }" '{$mesh, motions: $motions | split(" ")}')" >"$out/field.json"
field=$(jq -r .id "$out/field.json")
while jq -e '.state == "queued" or .state == "running"' "$out/field.json" >/dev/null; do
	sleep 1
	request GET "/v1/fields/$field" >"$out/field.json"
done
[ "$(jq -r .state "$out/field.json")" = succeeded ] || { echo; jq . "$out/field.json"; exit 1; }
end
echo

# --- layouts: the connection is held until the layout is there -------------------------------------------------------------
head='%-11s %-8s %13s %13s | %8s %8s %6s | %6s %6s %6s | %6s | %5s %5s %5s %5s %5s\n'

# lay_out SET: asks for one layout, waits for it and fetches its files; false where the service says no, or the job fails.
lay_out() {
	jq --arg field "$field" --argjson limit $limit_s '{field: $field, terminals: .terminals, options: {time_limit_s: $limit}}' \
		"$terminals/$1.json" >"$out/$1/request.json"
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
		def percent: if . == null then "-" else . * 100 | round(1) | "\(.)%" end;
		def saved($ours; $theirs): if $ours == null or $theirs == null or $theirs == 0 then null else 1 - $ours / $theirs end;
		def whole: if . == null then "-" else round(0) end;
		.summary | [ .outcome, .weight, .lower_bound, (.energy_mpa_mm2 | whole), (.baseline_energy_mpa_mm2 | whole),
		  (saved(.energy_mpa_mm2; .baseline_energy_mpa_mm2) | percent),
		  (.elongation_max | percent), (.baseline_elongation_max | percent),
		  (saved(.elongation_max; .baseline_elongation_max) | percent), .violations,
		  (.seconds | (.terminals, .tree, .baseline, (.curves + .metrics + .elongation + .artifacts), .total) | round(2)) ]
		| map(tostring) | join(" ")' "$out/$1/resource.json"
}

# shellcheck disable=SC2059
{
	printf "$head" '' '' 'weight' 'lower bound' 'energy' 'fewest' 'saved' 'max' 'fewest' 'saved' 'rules' 'place' 'tree' 'base' 'curve' 'all'
	printf "$head" 'terminals' 'outcome' '' '' 'MPa mm2' 'edges' '' 'elong.' 'edges' '' 'broken' 's' 's' 's' 's' 's'
}
failed=
for set in $sets; do
	mkdir -p "$out/$set"
	[ ! -t 1 ] || printf '%-11s …\r' "$set"
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
