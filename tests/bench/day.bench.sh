#!/bin/sh
# A simulated day with 100,000 batch jobs in the queue (see day.mjs).
set -eu
node tests/bench/day.mjs
