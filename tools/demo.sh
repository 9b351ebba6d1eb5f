#!/usr/bin/env bash
# Merges scans inside Blender and renders the result: out/demo.blend, out/demo.glb, out/demo.png and a table of the run.
# Usage: tools/demo.sh [SCANS.conf]      without scans of one's own a sculpture is scanned virtually
#        FRAMES=recording tools/demo.sh  frames of a phone or a depth camera: a folder, .r3d, .zip, .sens or transforms.json
# Scans of one's own are taken to be in metres with y up, as the Stanford archive's: UNIT=MM and UP=Z say otherwise.
# Recordings are in metres; up is where the images' upper edge is, unless UP=Y says the axis.
# The extension must have been built (make extension).
set -euo pipefail
. "$(dirname "$0")/lib.sh"

scans=() script=in_blender.py page=picture.py
if [ -n "${FRAMES:-}" ]; then
    [ -e "$FRAMES" ] || die "there is no recording $FRAMES"
    scans=("$(realpath "$FRAMES")") script=frames_in_blender.py page=frames_picture.py
elif [ $# -gt 0 ]; then
    [ -f "$1" ] || die "there is no file $1"
    scans=("$(realpath "$1")")
fi
archive=$(find "$root/out/extension" -name 'surfrecon-*.zip' 2>/dev/null | head -n 1)
[ -n "$archive" ] || die "the extension is not built: run make extension"

blender=$("$root/tools/venv.sh" blender-4.5)
pictures=$("$root/tools/venv.sh" demo)
font=$(find "$blender" -path '*datafiles/fonts/Inter.woff2' | head -n 1)

# Rendering needs no display and no graphics card.
export LIBGL_ALWAYS_SOFTWARE=1
log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "merging inside Blender:"
# Blender tells of every tile and file; what the demo says itself is indented. bpy is known to hang at exit: a time limit.
if ! timeout 900 "$blender/bin/python" "$root/demo/$script" "$archive" "$root/out" "${scans[@]}" 2>&1 |
    tee "$log" | grep --line-buffered '^  '; then
    # A program that ended with a sentence of its own needs no more.
    tail -n 1 "$log" | grep -q '^  ' || tail -n 40 "$log" >&2
    die "the demo failed inside Blender, see above"
fi
"$pictures/bin/python" "$root/demo/$page" "$root/out" "$font"
echo
echo "see out/demo.png, out/demo.blend, out/demo.glb"
