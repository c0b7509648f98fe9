#!/bin/sh
# Layout requests against a real service: see submit.mjs.
exec node tests/bench/submit.mjs
