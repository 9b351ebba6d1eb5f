"""Takes the folder that a wheel was built in out of its bill of materials: python tools/wheel_without_paths.py WHEEL...

maturin names packages of the workspace there by where they lie. Without it two builds are the same bytes, and nobody's
folders are published. What is there otherwise stays, in its order and with its times.
"""

import base64
import csv
import hashlib
import io
import os
import sys
import zipfile
from pathlib import Path

import platforms

FOLDER = platforms.ROOT.as_uri().encode()
INSTEAD = b"file:///surfrecon"


def without_paths(wheel):
    """Writes the wheel anew."""
    part = wheel.with_suffix(".part")
    changed = {}
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(part, "w") as new:
        for entry in old.infolist():
            content = old.read(entry)
            if "/sboms/" in entry.filename:
                content = content.replace(FOLDER, INSTEAD)
                changed[entry.filename] = recorded(content)
            elif entry.filename.endswith(".dist-info/RECORD"):
                content = record(content.decode(), changed).encode()
            new.writestr(entry, content, compresslevel=9)
    os.replace(part, wheel)


def recorded(content):
    """The entry of a file in RECORD: its hash and its size."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return [f"sha256={digest}", str(len(content))]


def record(text, changed):
    """RECORD with what changed; it is a wheel's last file."""
    lines = io.StringIO()
    rows = ([name, *changed.pop(name, rest)] for name, *rest in csv.reader(io.StringIO(text)))
    csv.writer(lines, lineterminator="\n").writerows(rows)
    if changed:
        sys.exit(f"RECORD does not list {', '.join(changed)}")
    return lines.getvalue()


if __name__ == "__main__":
    for name in sys.argv[1:]:
        without_paths(Path(name))
