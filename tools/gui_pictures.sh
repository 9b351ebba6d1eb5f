#!/usr/bin/env bash
# Takes the pictures that blender-addon/README.md shows from those that `make test-gui` took of the window: parts of it in their
# own size, as wide as pages show them. Those of the bunny and of the chair need SURFRECON_DATA there.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

[ -e out/gui/8_error_map.png ] || die "there are no pictures in out/gui: run make test-gui"
"$(tools/venv.sh demo)/bin/python" - <<'PYTHON'
from pathlib import Path

from PIL import Image

PICTURES = Path("out/gui")
# Widest picture that is shown as it is, and the gap between pictures that stand together.
WIDEST, GAP = 830, 10
# Parts of the window, in pixels from its upper left corner: the view with its sidebar, with the panel of F9, alone.
WITH_SIDEBAR, WITH_PANEL, ALONE = (358, 30, 1188, 900), (60, 30, 890, 900), (20, 34, 1168, 895)


def part(name, box):
    """A part of a picture of the window."""
    with Image.open(PICTURES / f"{name}.png") as window:
        return window.convert("RGB").crop(box)


def beside(pictures, columns):
    """Pictures in rows, as wide together as pages are."""
    width = (WIDEST - GAP * (columns - 1)) // columns
    height = width * 3 // 4
    rows = -(-len(pictures) // columns)
    page = Image.new("RGB", (WIDEST, rows * height + (rows - 1) * GAP), "white")
    for k, picture in enumerate(pictures):
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        page.paste(small, (k % columns * (width + GAP), k // columns * (height + GAP)))
    return page


def keep(picture, name):
    """Writes a picture of the page."""
    picture.save(f"blender-addon/pictures/{name}.webp", quality=85, method=6)


# Where the mouse was.
keep(part("2_import_dialog", (100, 400, 740, 700)), "import")
keep(part("3_scans", WITH_SIDEBAR), "scans")
keep(part("5_preview", WITH_SIDEBAR), "merging")
keep(part("8_error_map", WITH_SIDEBAR), "error")
keep(part("6_adjust", WITH_PANEL), "adjust")
photo = PICTURES / "chair_photo.jpg"
if photo.exists() and (PICTURES / "portrait_heap.png").exists():
    keep(beside([part(f"portrait_{name}", ALONE) for name in ("heap", "aligned")], 2), "heap")
    with Image.open(photo) as image:
        chair = [image.convert("RGB")]
    chair += [part(f"portrait_{name}", ALONE) for name in ("frames", "merged", "finished")]
    keep(beside(chair, 2), "chair")
else:
    print("left out: the pictures of the bunny and of the chair, for which make test-gui needs SURFRECON_DATA")
PYTHON
