#!/usr/bin/env bash
# Runs a command that builds in this tree alone: another that does waits for it and says so. What it calls is a part of it.
# Usage: tools/alone.sh COMMAND [ARGUMENT...]
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

if [ "${SURFRECON_ALONE:-}" != "$root" ]; then
    export SURFRECON_ALONE=$root
    mkdir -p target
    exec 8>target/alone.lock
    if command -v flock >/dev/null && ! flock -n 8; then
        say "waiting for another target of this tree to end"
        flock 8
    fi
fi
"$@" 8>&-
