"""Puts the files of this platform's wheel where PYTHONPATH can name them, and prints that folder.

The prepared Python environments are shared and stay as they are, so the wheel is not installed into them.
"""

import shutil
import sys
import zipfile

import platforms

TARGET = platforms.ROOT / "target"


def unpack(platform=None, folder=TARGET / "wheel-files"):
    """Returns the folder, freshly filled."""
    name = platform or platforms.here().name
    wheel = platforms.wheels().get(name)
    if wheel is None:
        sys.exit(f"unpack_wheel.py: there is no wheel for {name} in target/wheels: run `make wheel`")
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


if __name__ == "__main__":
    print(unpack())
