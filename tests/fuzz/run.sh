#!/bin/sh
# run.sh [SECONDS | RUNS"x"]: runs every fuzz target on its corpus for so many seconds (20), or for so many executions
# ("10000000x"). New inputs go to a folder that is thrown away, so that the corpus changes by hand only; an input that
# breaks a target is kept in build/fuzz/findings. Exit 1 when there was one.
set -u
limit=${1:-20}
case $limit in
*x) flag="-runs=${limit%x}" ;;
*) flag="-max_total_time=$limit" ;;
esac
cd "$(dirname "$0")/../.."
mkdir -p build/fuzz/findings
failed=0
for source in tests/fuzz/*.c; do
	name=$(basename "$source" .c)
	found=$(mktemp -d)
	mkdir -p "tests/fuzz/corpus/$name"
	"build/fuzz/tests/$name" "$flag" -timeout=20 -print_final_stats=1 \
		-artifact_prefix="build/fuzz/findings/$name-" "$found" "tests/fuzz/corpus/$name" >"build/fuzz/$name.log" 2>&1
	code=$?
	runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "build/fuzz/$name.log")
	if [ $code -eq 0 ]; then
		echo "ok   fuzz/$name: ${runs:-?} executions"
	else
		failed=1
		echo "FAIL fuzz/$name after ${runs:-?} executions:"
		tail -n 30 "build/fuzz/$name.log"
	fi
	rm -rf "$found"
done
[ $failed -eq 0 ]
