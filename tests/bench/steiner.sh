#!/bin/sh
# steiner.sh: Steiner instances of the sample suit, which are made here (23,500 vertices, and 723,000 after two midpoint
# refinements), then every instance of INSTANCES (see the README there), where that folder is; solved by TIGHTWIRE one after
# the other. A table to stdout and, when nothing was left out, tests/bench/steiner.csv, which is kept in the repository for
# each release.
#   BUILD    folder of the built programs; made instances are kept in its folder `instances`
#   Meshes with 36 terminals and more are also solved on two threads, where the run is on one: NAME_on_two.
#   LIMIT    seconds an instance may take (default 60)      THREADS  of the solver (default 1)
#   ONLY     a pattern of grep -E: only these instances      CSV      another file for the rows
# Exit 1 when a proven value is not the known optimum, or when a bound is above it.
set -u
limit=${LIMIT:-60} threads=${THREADS:-1} only=${ONLY:-.}
csv=${CSV:-}
[ -z "$csv" ] && [ "$only" = . ] && [ -d "$INSTANCES" ] && csv=tests/bench/steiner.csv
rows=$(mktemp) file=$(mktemp) wrong=0
trap 'rm -f "$rows" "$file"' EXIT

field() { echo "$answer" | sed -n "s/.*\"$1\":\([^,}]*\).*/\1/p" | tr -d '"'; }

solve() { # NAME OPTIMUM: one row
	answer=$("$TIGHTWIRE" steiner "$file" --time-limit "$limit" --threads "$threads" --json --stats 2>/dev/null)
	[ -n "$answer" ] || { echo "$1: no answer"; wrong=1; return; }
	weight=$(field weight) bound=$(field lower_bound) outcome=$(field outcome)
	seconds=$(field total)
	verdict=-
	if [ -n "$2" ]; then
		verdict=yes
		[ "$weight" = "$2" ] || verdict=no
		[ "$outcome$verdict" = optimalno ] && verdict=WRONG
		{ [ "$bound" -gt "$2" ] || [ "$weight" -lt "$2" ]; } && verdict=WRONG
		[ $verdict = WRONG ] && wrong=1
	fi
	echo "$1,$(field vertices_left),$outcome,$seconds,$(field work),$weight,$bound,$(field gap_percent),$(field memory_peak_bytes),$(field labels),$(field sets),$(field branch_nodes),$verdict" >>"$rows"
	tail -n 1 "$rows" | awk -F, '{ printf "%-24s %-9s %9.3f %9.1f %12s %8.4f %7.1f %10s %8s %6s %7s %s\n",
		$1, $3, $4, $5 / 1e6, $6, $8, $9 / 1048576, $10, $11, $12, $2, $13 }'
}

list() { # LIST COMMAND…: COMMAND NAME writes the instance
	rows_of=$1; shift
	[ -f "$rows_of" ] || return 0
	tail -n +2 "$rows_of" | tr -d "\r" | grep -E "$only" | while IFS= read -r row; do echo "${row%%,*} ${row##*,}"; done >"$file.list"
	while read -r name optimum; do
		"$@" "$name" >"$file" || { echo "$name: cannot be read"; continue; }
		solve "$name" "$optimum"
		case $threads/$name in 1/*haptic[38]* | 1/*_t036_* | 1/*_t060_* | 1/*_t100_*) solve_on_two "$name" "$optimum" ;; esac
	done <"$file.list"
	rm -f "$file.list"
}

solve_on_two() { # the same instance with two threads: the same answer, sooner
	threads=2
	solve "$1_on_two" "$2"
	threads=1
}

without_optimum() { # terminal sets of meshes whose optimum nobody has proven before
	echo instance,optimum
	for terms in "$INSTANCES"/*.terms; do
		name=$(basename "$terms" .terms)
		grep -q "^$name," "$INSTANCES/optima.csv" || echo "$name,"
	done
}

make_suits() { # NAME VERTICES ROUNDS SET…: the sample suit's instances, made once
	suits=$1 vertices=$2 rounds=$3
	shift 3
	mkdir -p "$BUILD/instances"
	for set; do
		name=${suits}_$set
		echo "$name" | grep -qE "$only" || continue
		suit=$BUILD/instances/$name.gr
		[ -s "$suit" ] || { "$BUILD/tests/tools/suit_instance" "$vertices" "$rounds" "$set" >"$suit.part" && mv "$suit.part" "$suit"; }
		cp "$suit" "$file" && solve "$name" ""
	done
}

mesh() { sh "$INSTANCES/join.sh" "$1"; }
pace() { gzip -dc "$INSTANCES/pace2018/$1.gr.gz"; }
track3() { gzip -dc "$INSTANCES/pace2018_track3/${1#track3_}.gr.gz"; }

printf '%-24s %-9s %9s %9s %12s %8s %7s %10s %8s %6s %7s %s\n' instance outcome seconds Mwork weight 'gap %' MiB labels sets \
	nodes left optimum
make_suits sample23k 23500 0 joints10 segments17 muscles36 muscles80
make_suits sample723k 45500 2 joints10 muscles36
move() { # NAME: a terminal moved by up to 8 hops, 60 mm of a suit, 30 times; not in the CSV
	echo "$1" | grep -qE "$only" || return 0
	mesh "$1" >"$file" || return 0
	answer=$("$BUILD/tests/tools/moved_terminal" "$file" 30 8) || { echo "$1, moved: no proof"; wrong=1; return; }
	echo "$answer" | awk -v name="$1, moved" '{ printf "%-30s median %.3f s, 19 of 20 in %.3f s\n", name, $1, $2 }'
}

[ -d "$INSTANCES" ] || echo "no folder $INSTANCES: set INSTANCES=DIR for more"
list "$INSTANCES/optima.csv" mesh
[ -d "$INSTANCES" ] && without_optimum >"$file.more" && list "$file.more" mesh && rm -f "$file.more"
list "$INSTANCES/pace2018/optima.csv" pace
for graph in suitL_e001 suitL_e020 fieldL_mesh fieldL_chords; do
	[ -d "$INSTANCES" ] && move ${graph}_xsens17 && move ${graph}_haptic36
done
sed '2,$s/^/track3_/' "$INSTANCES/pace2018_track3/optima.csv" >"$file.more" 2>/dev/null && list "$file.more" track3
rm -f "$file.more"
echo "proven: $(grep -c ,optimal, "$rows") of $(wc -l <"$rows") within $limit s each; $(grep -c 'WRONG$' "$rows") wrong"
if [ -n "$csv" ]; then
	{ echo "instance,vertices_left,outcome,seconds,work,weight,lower_bound,gap_percent,memory_bytes,labels,sets,branch_nodes,is_known_optimum"
	  cat "$rows"; } >"$csv"
	echo "rows: $csv"
fi
exit $wrong
