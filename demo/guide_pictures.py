"""The steps of the guides inside Blender: what each begins with, what each step makes, as panels of pictures.

Usage: python guide_pictures.py ZIP OUT [GUIDE...]      with the Python of a Blender module; without GUIDE all
Makes the scans of `made_scans.py`, does with them what the guides say, and writes OUT/<picture>-<panel>.png and
OUT/guides.json with the captions, whose figures are those of the results.
"""

import contextlib
import json
import os
import sys
import tempfile
from pathlib import Path

# Must be set before the first `import bpy`.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="surfrecon-guides-")

import bpy
from guide_drawing import MODULE, Pictures, clear


def main():
    """Makes scans, takes all pictures."""
    archive, out, *only = sys.argv[1], Path(sys.argv[2]).resolve(), *sys.argv[3:]
    out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    if MODULE not in bpy.context.preferences.addons:
        sys.exit("Blender refused the extension")
    # Only now the package is there.
    import guide_steps
    import made_scans

    pictures = Pictures(out)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        made_scans.make_all(Path("."))
        for name, draw in guide_steps.GUIDES.items():
            if not only or name in only:
                draw(pictures)
                clear()
    (out / "guides.json").write_text(json.dumps(pictures.told, indent=1))
    sys.stdout.flush()
    # The module's own way out hangs.
    os._exit(0)


if __name__ == "__main__":
    main()
