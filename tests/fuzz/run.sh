#!/bin/sh
# run.sh [SECONDS | RUNS"x"] [TARGET…]: runs fuzz targets (all of them, when none is named) from their corpus for so many
# seconds each (20), or for so many executions ("10000000x"), and says how many there were. An input that breaks a target
# is kept in build/fuzz/findings. Exit 1 when there was one.
#   KEEP=1  adds to the corpus what was found on the way and reaches code that nothing in the corpus does, the fewest
#           inputs that do; otherwise new inputs are thrown away
set -u
limit=${1:-20}
[ $# -gt 0 ] && shift
case $limit in
*x) flag="-runs=${limit%x}" ;;
*) flag="-max_total_time=$limit" ;;
esac
cd "$(dirname "$0")/../.."
mkdir -p build/fuzz/findings
# Most of the time would go into remembering stacks and freed memory; what is left finds the same.
export ASAN_OPTIONS="${ASAN_OPTIONS:-quarantine_size_mb=16:malloc_context_size=0}"
[ $# -gt 0 ] || set -- $(ls tests/fuzz/*.c | sed 's|.*/\(.*\)\.c|\1|')

# Bytes of the longest input: a few faces, frames or members. Longer ones take time and find nothing else.
longest() {
	case $1 in
	motion | motion_tar) echo 4096 ;;
	request | layout_request) echo 1024 ;;
	strip) echo 65 ;;
	*) echo 512 ;;
	esac
}

failed=0
for name; do
	corpus="tests/fuzz/corpus/$name" log="build/fuzz/$name.log"
	found=$(mktemp -d)
	mkdir -p "$corpus"
	start=$(date +%s)
	"build/fuzz/tests/$name" "$flag" -max_len="$(longest "$name")" -timeout=20 -print_final_stats=1 \
		-artifact_prefix="build/fuzz/findings/$name-" "$found" "$corpus" >"$log" 2>&1
	code=$?
	runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
	if [ $code -eq 0 ]; then
		echo "ok   fuzz/$name: ${runs:-?} executions in $(($(date +%s) - start)) s"
	else
		failed=1
		echo "FAIL fuzz/$name after ${runs:-?} executions:"
		tail -n 30 "$log"
	fi
	[ "${KEEP:-0}" = 1 ] &&
		"build/fuzz/tests/$name" -set_cover_merge=1 -use_counters=0 "$corpus" "$found" >>"$log" 2>&1
	rm -rf "$found"
done
[ $failed -eq 0 ]
