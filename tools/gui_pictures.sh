#!/usr/bin/env bash
# Takes the pictures that blender-addon/README.md shows from those that `make test-gui` took of the window.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

[ -e out/gui/8_error_map.png ] || die "there are no pictures in out/gui: run make test-gui"
"$(tools/venv.sh demo)/bin/python" - <<'PYTHON'
from PIL import Image

for picture, name in (
    ("2_import_dialog", "import"),
    ("3_scans", "scans"),
    ("5_preview", "merging"),
    ("8_error_map", "error"),
    ("6_adjust", "adjust"),
):
    with Image.open(f"out/gui/{picture}.png") as window:
        window = window.convert("RGB").crop((0, 0, 1160, window.height))
        # The dialog opens in the lower left corner.
        if name == "import":
            window = window.crop((0, window.height - 320, 640, window.height))
        window.save(f"blender-addon/pictures/{name}.webp", quality=80, method=6)
PYTHON
