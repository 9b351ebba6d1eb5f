#!/usr/bin/env bash
# Runs a command in the system that tools/gui_root.sh prepares, with this tree at /tree and the folder SURFRECON_DATA, if there is
# one, at /data. Usage: tools/gui_enter.sh FOLDER COMMAND...
# Mounts are made in a namespace of their own: they end with the command, and nobody else sees them.
set -euo pipefail
folder=${1:?usage: tools/gui_enter.sh FOLDER COMMAND...}
shift
tree=$(cd "$(dirname "$0")/.." && pwd)
data=${SURFRECON_DATA:-}
mkdir -p "$folder/tree" "$folder/data"
exec unshare --mount --pid --fork --kill-child -- sh -c '
    folder=$1 tree=$2 data=$3
    shift 3
    mount --make-rprivate / && mount --bind /dev "$folder/dev" && mount -t proc proc "$folder/proc" &&
        mount -t sysfs sys "$folder/sys" && mount -t devpts devpts "$folder/dev/pts" && mount --bind "$tree" "$folder/tree"
    if [ -n "$data" ]; then mount --bind -o ro "$data" "$folder/data"; fi
    # Not in its place: a display server does not talk to a parent that is process 1.
    chroot "$folder" "$@"' sh "$folder" "$tree" "$data" "$@"
