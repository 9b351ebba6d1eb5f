"""Completes a folder of a release's files with bills of materials and checksums: python tools/release_folder.py DIR"""

import argparse
import hashlib
import re
import sys
import zipfile
from pathlib import Path

import platforms


def complete(folder):
    """Writes both; without a wheel no bill."""
    bills_of_materials(folder)
    checksums(folder)


def bills_of_materials(folder):
    """The crates linked on each platform, as CycloneDX. maturin puts it into the wheel, which links what all do."""
    for wheel in folder.glob("surfrecon-*.whl"):
        with zipfile.ZipFile(wheel) as built:
            bill = next(name for name in built.namelist() if re.search(r"/sboms/.*\.cyclonedx\.json$", name))
            name = f"surfrecon-{platforms.version()}-{platforms.of_wheel(wheel).name}.cyclonedx.json"
            (folder / name).write_bytes(built.read(bill))


def checksums(folder):
    """SHA256SUMS, as sha256sum -c reads it."""
    files = sorted(path for path in folder.iterdir() if path.name != "SHA256SUMS")
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    # Line ends of Unix on every system.
    (folder / "SHA256SUMS").write_bytes("".join(lines).encode())


def main():
    """Completes the folder that is named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    if not folder.is_dir():
        sys.exit(f"{folder} is not a folder")
    complete(folder)


if __name__ == "__main__":
    main()
