"""Puts the files of the newest wheel where PYTHONPATH can name them, and prints that folder.

The prepared Python environments are shared and stay as they are, so the wheel is not installed into them.
"""

import shutil
import sys
import zipfile
from pathlib import Path

TARGET = Path(__file__).resolve().parent.parent / "target"


def unpack():
    """Returns the folder, freshly filled."""
    wheels = sorted((TARGET / "wheels").glob("surfrecon-*.whl"), key=lambda path: path.stat().st_mtime)
    if not wheels:
        sys.exit("unpack_wheel.py: there is no wheel in target/wheels: run `make wheel`")
    folder = TARGET / "wheel-files"
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(wheels[-1]) as wheel:
        wheel.extractall(folder)
    return folder


if __name__ == "__main__":
    print(unpack())
