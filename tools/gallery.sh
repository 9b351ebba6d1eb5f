#!/usr/bin/env bash
# Renders from virtual scans inside Blender: the gallery of the README for artists, blender-addon/pictures/gallery.webp, and
# the steps of the guides, docs/pictures/guides/.
# The extension must have been built (make extension). Screened Poisson, which one picture shows, is in the environment of
# the benchmarks.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

archive=$(find out/extension -name 'surfrecon-*.zip' 2>/dev/null | head -n 1)
[ -n "$archive" ] || die "the extension is not built: run make extension"
blender=$(tools/venv.sh blender-4.5)
pictures=$(tools/venv.sh demo)
font=$(find "$blender" -path '*datafiles/fonts/Inter.woff2' | head -n 1)
export LIBGL_ALWAYS_SOFTWARE=1
mkdir -p out/gallery
log=out/gallery/blender.log
timeout 900 "$blender/bin/python" demo/gallery.py "$archive" out/gallery >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "the gallery failed inside Blender, see above"; }
"$pictures/bin/python" demo/gallery_page.py out/gallery "$font" blender-addon/pictures/gallery.webp

peers=$(tools/venv.sh bench)
files=$("$peers/bin/python" tools/unpack_wheel.py)
PYTHONPATH=$files "$peers/bin/python" bench/close_statue.py out/gallery/guides

log=out/gallery/guides.log
timeout 1800 "$blender/bin/python" demo/guide_pictures.py "$archive" out/gallery/guides >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "the pictures of the guides failed inside Blender, see above"; }
"$pictures/bin/python" demo/guide_page.py out/gallery/guides "$font" docs/pictures/guides
