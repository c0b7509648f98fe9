#!/bin/sh
# Fails on an include that the design forbids: who may include whom, and no circles between files.
#   solver   tightwire.h, itself            storage  tightwire.h, itself
#   api      + storage, solver's option tables and request parsers    service  all
set -eu
cd "$(dirname "$0")/.."
bad=0
mkdir -p build

includes() { # ROOM: "file:included" for every include of the project's own files
	grep -rnoE --include='*.[ch]' --include='*.cc' '^#include "[^"]+"' "$1" | sed -E 's/^([^:]+):[0-9]+:#include "([^"]+)"/\1:\2/'
}

forbid() { # ROOM PATTERN: no include of ROOM may lie outside PATTERN
	hits=$(includes "$1" | grep -vE ":($2)" || true)
	[ -z "$hits" ] || { echo "layering: $1/ may not include:"; echo "$hits"; bad=1; }
}

forbid solver 'tightwire\.h$|solver/'
forbid storage 'tightwire\.h$|storage/'
forbid api 'tightwire\.h$|api/|storage/|solver/option|solver/names|solver/[a-z]+/request\.h$|solver/[a-z]+/options\.h$'
forbid service 'tightwire\.h$|service/|api/|storage/|solver/'

# C++ only behind solver's OpenMesh header; SQL only in storage; sockets only in service.
cc=$(find solver storage api service -name '*.cc' | grep -v '^solver/garment/openmesh\.cc$' || true)
[ -z "$cc" ] || { echo "layering: C++ outside solver/garment/openmesh.cc: $cc"; bad=1; }
only() { # ROOM HEADER
	hits=$(grep -rlE "^#include <$2" solver storage api service | grep -v "^$1/" || true)
	[ -z "$hits" ] || { echo "layering: <$2 belongs to $1/, but: $hits"; bad=1; }
}
only storage 'sqlite3\.h'
only service 'microhttpd\.h'
only service 'modbus'
only solver 'OpenMesh'

# No circles between files; a header and the source of the same name are one.
includes . | sed -E 's/^\.\///; s/\.(h|c|cc):/ /; s/\.(h|c|cc)$//' | tsort >/dev/null 2>build/.circles || true
if [ -s build/.circles ]; then echo "layering: a circle of files:"; cat build/.circles; bad=1; fi
[ $bad -eq 0 ] && echo "layering: clean"
exit $bad
