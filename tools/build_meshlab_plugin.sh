#!/usr/bin/env bash
# Builds the MeshLab plugin: out/meshlab-plugin/VERSION-SCALAR/lib{filter,io}_surfrecon.so
# Usage: tools/build_meshlab_plugin.sh [VERSION-SCALAR...]      without any: every version, for MeshLab and for pymeshlab
# Ends with status 3 where nothing but MeshLab's headers can't be had. SURFRECON_BUILT may name a folder with a built library to link.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

all=$#
[ $# -gt 0 ] || set -- 2020.09-float 2022.02-float 2022.02-double 2023.12-float 2023.12-double 2025.07-float 2025.07-double
built=${SURFRECON_BUILT:-$root/${CARGO_TARGET_DIR:-target}/release}
[ -n "${SURFRECON_BUILT:-}" ] || cargo build --quiet --locked --release --package surfrecon-capi
library=$built/libsurfrecon.a

log=$(mktemp) licences=$(mktemp)
trap 'rm -f "$log" "$licences"' EXIT
"$(tools/python.sh)" tools/third_party_licences.py "$licences"
without_headers=0
for build in "$@"; do
    version=${build%-*} scalar=${build##*-}
    # No release of Debian has 2023.12; all that differs from 2025.07 is comments.
    headers=${version/2023.12/2025.07}
    if ! source=$(tools/meshlab_source.sh "$headers"); then
        say "left out: the plugin for MeshLab $version"
        without_headers=$((without_headers + 1))
        continue
    fi
    folder=$root/target/meshlab-plugin/$build-$(basename "$built")
    { cmake -S meshlab-plugin -B "$folder" -DCMAKE_BUILD_TYPE=Release -DCMAKE_COMPILE_WARNING_AS_ERROR=ON \
        -DMESHLAB_VERSION="$version" -DMESHLAB_SCALAR="$scalar" -DMESHLAB_SOURCE_DIR="$source" -DSURFRECON_LIBRARY="$library" && cmake --build "$folder" --parallel "$(nproc)"; } >"$log" 2>&1 || {
        cat "$log" >&2
        die "the plugin for MeshLab $version ($scalar) could not be built, see above"
    }
    mkdir -p "out/meshlab-plugin/$build"
    cp "$folder"/plugins/*.so meshlab-plugin/LICENSE "out/meshlab-plugin/$build/"
    cp "$licences" "out/meshlab-plugin/$build/LICENSES-THIRD-PARTY.txt"
    echo "out/meshlab-plugin/$build"
done
# Of all versions those that can be had are what was asked for; a version that was named is not there.
[ $without_headers = 0 ] || { [ "$all" = 0 ] && [ $without_headers -lt $# ]; } || exit 3
