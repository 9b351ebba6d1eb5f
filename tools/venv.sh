#!/usr/bin/env bash
# Makes the Python environment NAME from tools/requirements/NAME.txt, unless it exists, and prints its folder.
# A first line `# python VERSION` there asks for another Python than 3.11; status 3 where that is not at hand.
# Usage: tools/venv.sh NAME            e.g.  "$(tools/venv.sh blender-4.5)/bin/python" -m pytest tests/blender
#        tools/venv.sh --where NAME    prints the folder alone, whether it is there or not
# The environment is kept in the cache under a hash of its requirements: never install anything else into it.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

where=
[ "${1:-}" != --where ] || { where=1; shift; }
name=${1:?usage: tools/venv.sh [--where] NAME}
requirements=$root/tools/requirements/$name.txt
[ -f "$requirements" ] || die "there is no environment $name: its list of packages would be tools/requirements/$name.txt"
python=$("$root/tools/python.sh" "$(sed -n '1s/^# python //p' "$requirements")")

key=$({ "$python" -VV; cat "$requirements"; } | sha256sum | cut -c1-12)
venv=$cache/venv/$name-$key
if [ -z "$where" ] && [ ! -e "$venv/.complete" ]; then
    lock "venv-$name"
    if [ ! -e "$venv/.complete" ]; then
        say "preparing the Python environment $name"
        rm -rf "$venv"
        "$python" -m venv "$venv" >&2 || die "python can't make environments: on Debian, apt-get install python3.11-venv"
        # Wheels only: nothing is compiled and no package runs code of its own while it is installed.
        retry "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --only-binary :all: \
            --retries 5 --timeout 60 --requirement "$requirements" >&2 ||
            die "pip could not install tools/requirements/$name.txt: is the package index reachable?"
        touch "$venv/.complete"
    fi
fi
echo "$venv"
