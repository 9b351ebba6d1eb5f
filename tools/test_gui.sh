#!/usr/bin/env bash
# Runs the extension in the window of a real Blender, under a virtual display: tools/test_gui.sh [SCRIPT...], scripts of
# this tree instead of the tests. Pictures: out/gui/. JOURNEYS="bunny chair" names ways of tests/gui/journeys.py.
# Ends with status 3 where something was skipped, as what needs real scans is without SURFRECON_DATA.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

folder=$(tools/gui_root.sh)
zip=$(ls out/extension/surfrecon-*-linux-x64.zip 2>/dev/null | head -1)
[ -n "$zip" ] || die "there is no extension in out/extension: run \`make extension\`"
[ $# -gt 0 ] || rm -rf out/gui
mkdir -p out/gui
# The files that a server would have, for the test that installs from one.
repository=target/gui-repository
rm -rf $repository
mkdir -p $repository
cp out/extension/*.zip $repository/
"$(tools/python.sh)" tools/extension_index.py $repository >/dev/null

status=0
[ $# -gt 0 ] || set -- tests/gui/window.py tests/gui/promises.py tests/gui/repository.py tests/gui/journeys.py
data=()
if [ -n "${SURFRECON_DATA:-}" ]; then data=(SURFRECON_DATA=/data); fi
for script in "$@"; do
    timeout 1800 tools/gui_enter.sh "$folder" env -i PATH=/usr/bin:/bin:/usr/games LANG=C.UTF-8 HOME=/root \
        BLENDER_USER_RESOURCES="/var/profile-$$-$(basename "$script" .py)" LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe \
        SURFRECON_ZIP="/tree/$zip" SURFRECON_REPOSITORY="/tree/$repository" SURFRECON_PICTURES=/tree/out/gui \
        JOURNEYS="${JOURNEYS:-}" "${data[@]}" \
        xvfb-run -a -s '-screen 0 1440x1000x24 -nolisten tcp' \
        blender --enable-event-simulate --factory-startup --window-geometry 0 0 1440 1000 --python-exit-code 7 \
        --python "/tree/$script" && continue
    # What failed counts for more than what was skipped.
    if [ $? = 3 ]; then [ $status != 0 ] || status=3; else status=1; fi
done
[ $status != 3 ] || say "SKIPPED: see the lines above that begin so"
exit $status
