#!/usr/bin/env bash
# Prints the folder of a Debian 13 with Blender 4.3 and a virtual display, for the tests in a real window. Prepares it first, in
# the cache, unless it is there: 2 GB. Only root can; ends with status 3 where it can't be had.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

folder=$cache/gui/trixie
if [ ! -e "$folder/.complete" ]; then
    lock gui
    if [ ! -e "$folder/.complete" ]; then
        [ "$(id -u)" = 0 ] || { say "only root can prepare the system for the tests in a window"; exit 3; }
        "$root/tools/setup_apt.sh" gui
        mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
        say "preparing Debian 13 with Blender in $folder"
        rm -rf "$folder"
        mkdir -p "$folder"
        retry debootstrap --variant=minbase trixie "$folder" "$mirror" >/dev/null || { say "$mirror does not answer"; exit 3; }
        # No service starts in there.
        printf '#!/bin/sh\nexit 101\n' >"$folder/usr/sbin/policy-rc.d"
        chmod +x "$folder/usr/sbin/policy-rc.d"
        cp /etc/resolv.conf /etc/hosts "$folder/etc/"
        retry "$root/tools/gui_enter.sh" "$folder" sh -c 'apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq \
            --no-install-recommends blender xvfb xauth imagemagick libgl1-mesa-dri libegl1 fonts-dejavu-core python3-numpy' \
            >/dev/null || { say "Blender could not be installed from $mirror"; exit 3; }
        touch "$folder/.complete"
    fi
fi
echo "$folder"
