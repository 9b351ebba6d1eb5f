#!/usr/bin/env bash
# Prints the Python 3.11 to use: $PYTHON if set, else python3.11, else a python3 of that version.
# Blender 4.2 to 5.0 embed Python 3.11, and so do their bpy modules.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

for candidate in ${PYTHON:-} python3.11 python3 python; do
    if "$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then
        "$candidate" -c 'import sys; print(sys.executable)'
        exit 0
    fi
done
die "Python 3.11 is missing: install it, or set PYTHON to it"
