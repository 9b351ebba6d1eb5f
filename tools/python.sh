#!/usr/bin/env bash
# Prints the Python to use: tools/python.sh [VERSION]. 3.11 unless another is asked for: $PYTHON if that is set, else
# python3.11, else a python3 of that version, else pyenv's. Ends with status 3 where there is none.
# Blender 4.2 to 5.0 embed Python 3.11, and so do their bpy modules; Blender 5.1 and newer 3.13.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

version=${1:-3.11}
for candidate in ${PYTHON:-} "python$version" python3 python "${PYENV_ROOT:-${HOME:-~}/.pyenv}"/versions/"$version".*/bin/python; do
    if "$candidate" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2>/dev/null; then
        "$candidate" -c 'import sys; print(sys.executable)'
        exit 0
    fi
done
say "Python $version is missing: install it, or set PYTHON to it"
exit 3
