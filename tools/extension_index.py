"""Makes a folder of extension zips one that Blender can install from: python tools/extension_index.py DIR

Writes DIR/index.json with Blender's own tool. All platforms are in it; each Blender takes the zip of its own. Addresses
in it are relative: the folder works wherever it is put whole, on a server, as the files of a release, as `file://`.
"""

import argparse
import json
import sys
import zipfile
from pathlib import Path

from build_extension import blender_tool, call


def is_extension(path):
    """Whether a zip is one: a release's folder has others, too."""
    try:
        with zipfile.ZipFile(path) as archive:
            return "blender_manifest.toml" in archive.namelist()
    except zipfile.BadZipFile:
        sys.exit(f"{path} is not a whole zip: build it again, or take it away")


def main():
    """Writes the index and looks at it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    if not folder.is_dir():
        sys.exit(f"{folder} is not a folder")
    zips = [path for path in sorted(folder.glob("*.zip")) if is_extension(path)]
    if not zips:
        sys.exit(f"{folder} has no extension: build them with tools/build_extension.py")
    index = folder / "index.json"
    index.unlink(missing_ok=True)
    call([sys.executable, blender_tool(), "server-generate", "--repo-dir", folder])
    # It leaves out what it can't read, with a message, and ends well.
    listed = {Path(entry["archive_url"]).name for entry in json.loads(index.read_text())["data"]}
    missing = [path.name for path in zips if path.name not in listed]
    if missing:
        sys.exit(f"Blender's tool left out of {index}: {', '.join(missing)}")
    print(index)


if __name__ == "__main__":
    main()
